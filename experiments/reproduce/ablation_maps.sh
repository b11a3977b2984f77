#!/usr/bin/env bash
# What each term of the maps' loss, and a camera in front of the views, are worth at equal time, on the fixed lists of rooms.
# minutes: 90
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
[ -e data/judge/training_3 ] || bash experiments/rooms/trace.sh 32 --no-light >&2 # the last of the lists
result experiments/configs/ablation_maps.toml "$@" -- --table curves --plot ratio
