#!/usr/bin/env bash
# The paper's radiance field and its loss, and ours in the place of either, after equal time on equal rooms.
# minutes: 560
# usage: bash experiments/reproduce/paper_form.sh [KEY=VALUE...]
#   train.minutes=10    shorter trainings
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/paper_form.toml "$@" -- --table curves --plot ratio
