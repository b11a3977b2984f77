#!/usr/bin/env bash
# The maps' net as we build it beside that of Li et al. 2020, as large, after equal time on equal rooms, on the fixed lists.
# minutes: 210
# usage: bash experiments/reproduce/side_by_side_maps.sh [KEY=VALUE...]
#   train.minutes=10    shorter trainings
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
[ -e data/judge/training_3 ] || bash experiments/rooms/trace.sh 32 --no-light >&2 # the last of the lists
result experiments/configs/side_by_side_maps.toml "$@" -- --table curves --plot ratio
