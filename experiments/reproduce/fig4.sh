#!/usr/bin/env bash
# Figure 4 of Zhu et al. 2022: the Monte Carlo layer beside a grid of 8 x 16 directions, under the photograph as light and
# under learned light.
# minutes: 60
# usage: bash experiments/reproduce/fig4.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
#   study.method=li2020   with the light of Li et al., once weights of it are trained, in place of ours
# Not here: Li et al.'s whole pipeline, whose maps would be other ones. The pictures lie in the runs that it names,
# artifacts/view*.png: photograph, the same light at many samples, Li et al.'s grid and surface model, their grid with ours,
# our layer and the paper's in the time of the grid.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/fig4.toml -m study.light=image,net "$@" -- --table layer --plot glossy
