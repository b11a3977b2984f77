#!/usr/bin/env bash
# What a term of detail in the maps' loss, rooms painted anew each time they are seen, and both are worth at equal time.
# minutes: 90
# usage: bash experiments/reproduce/ablation_detail.sh [KEY=VALUE...]
#   ablation.seeds=1 train.minutes=1    shows the way
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
[ -e data/judge/training_3 ] || bash experiments/rooms/trace.sh 32 --no-light >&2 # the last of the lists
result experiments/configs/ablation_detail.toml "$@" -- --table edges --plot ratio
