#!/usr/bin/env bash
# In view LightNet or the photograph itself, out of view the same net: what a user gets.
# minutes: 15
# usage: bash experiments/reproduce/completed.sh [KEY=VALUE...]
#   user.truth_spp=256    a truth of more noise
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/completed.toml "$@" -- --table 1_user --plot "re-render"
