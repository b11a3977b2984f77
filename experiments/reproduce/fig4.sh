#!/usr/bin/env bash
# Figure 4 of Zhu et al. 2022: the Monte Carlo layer beside a grid of 8 x 16 directions, under the photograph as light and
# under learned light.
# minutes: 60
# usage: bash experiments/reproduce/fig4.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
#   li2020.weights=DIR    the folder of Li et al.'s weights (within this tree): their light under both layers, too
# Not here: Li et al.'s whole pipeline, whose maps would be other ones. The pictures lie in the runs that it names,
# artifacts/view*.png: photograph, the same light at many samples, Li et al.'s grid and surface model, their grid with ours,
# our layer and the paper's in the time of the grid.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
lights=image,net
[[ " $*" != *" li2020.weights="* ]] || lights+=,li2020
result experiments/configs/fig4.toml -m study.light=$lights "$@" -- --table layer --plot glossy
