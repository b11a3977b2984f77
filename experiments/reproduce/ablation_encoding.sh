#!/usr/bin/env bash
# LightNet's random Fourier features: how many, and how wide.
# minutes: 30
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_encoding.toml "$@"
