#!/usr/bin/env bash
# Weights of the fits of lamps and of the constant light, FLOOR,RIDGE, chosen on rooms on which nothing is judged.
# minutes: 45
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/lamps.toml "$@" -- --table 1_user --plot "diffuse ball"
