#!/usr/bin/env bash
# Figure 5 of Zhu et al. 2022: maps of unseen rooms, ours, those of Li et al. 2020, and the truth.
# minutes: 15
# usage: bash experiments/reproduce/fig5.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
#   study.rival=li2020    the nets of Li et al. beside ours, once weights of them are trained, or of any method, by its folder;
#                         without it the table names them as lacking
# The pictures lie in the run that it prints, artifacts/room*.png: a row for each method, the truth's last.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/fig5.toml "$@" -- --table 1_maps --plot normals
