#!/usr/bin/env bash
# How LightNet's last number becomes radiance.
# minutes: 50
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_light_output.toml "$@"
