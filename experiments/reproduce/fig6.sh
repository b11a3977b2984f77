#!/usr/bin/env bash
# Figure 6 of Zhu et al. 2022: a mirror ball and the bunny as a mirror in unseen rooms, beside the tracer's.
# minutes: 60
# usage: bash experiments/reproduce/fig6.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
#   study.rival=li2020    the nets of Li et al. beside ours, once weights of them are trained, or of any method, by its folder;
#                         without it the table names them as lacking
# The pictures lie in the run that it prints, artifacts/room*.png: a row for each object; photograph, truth, then lights in
# the table's order, with predicted maps.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/fig6.toml "$@" -- --table 1_objects --plot "PSNR as shown"
