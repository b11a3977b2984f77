#!/usr/bin/env bash
# The encoder and the decoder of the maps' net at equal time, and what learning on ImageNet first is worth.
# minutes: 50
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_encoder.toml "$@"
