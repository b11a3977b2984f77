#!/usr/bin/env bash
# Light learned ray by ray, with the irradiance of each row of rays, and with the picture rendered again.
# minutes: 50
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_irradiance.toml "$@"
