#!/usr/bin/env bash
# The light learned from clamped truth, from HDR truth, and under the relative loss.
# minutes: 35
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_hdr.toml "$@"
