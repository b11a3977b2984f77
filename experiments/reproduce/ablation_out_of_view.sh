#!/usr/bin/env bash
# Who answers for light along rays and at free probes: photograph, SSRT, out of view, both.
# minutes: 45
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_out_of_view.toml "$@"
