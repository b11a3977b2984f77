#!/usr/bin/env bash
# The light as we build it beside that of Li et al. 2020, both compact, after equal time on equal rooms, on unseen rooms.
# minutes: 230
# usage: bash experiments/reproduce/side_by_side_light.sh [KEY=VALUE...]
#   train.minutes=10    shorter trainings
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/side_by_side_light.toml "$@" -- --table curves --plot ratio
