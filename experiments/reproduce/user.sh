#!/usr/bin/env bash
# What a user gets of one photograph of a room whose content no training has seen, beside the strongest simple answers.
# minutes: 35
# usage: bash experiments/reproduce/user.sh [KEY=VALUE...]
#   study.seeds=1         one draw of the layer's samples, which the rooms' spread hides
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/user.toml "$@" -- --table 1_user --plot "diffuse ball"
