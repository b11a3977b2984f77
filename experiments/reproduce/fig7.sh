#!/usr/bin/env bash
# Figure 7 of Zhu et al. 2022 without its stereo rival: mirror objects seen by two cameras, from one photograph each.
# minutes: 50
# usage: bash experiments/reproduce/fig7.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
#   study.rival=li2020    the nets of Li et al. beside ours, once weights of them are trained, or of any method, by its folder;
#                         without it the table names them as lacking
# The pictures lie in the run that it prints, artifacts/room*.png: a row for each object and camera; photograph, truth, then
# lights in the table's order, with predicted maps.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/fig7.toml "$@" -- --table 1_objects --plot "PSNR as shown"
