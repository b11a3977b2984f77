#!/usr/bin/env bash
# The width of LightNet: error against time.
# minutes: 30
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/mlp_width.toml "$@"
