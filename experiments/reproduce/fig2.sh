#!/usr/bin/env bash
# Figure 2 of Zhu et al. 2022, with rooms that can be had without a download: bare boxes of one lamp, a few blocks and balls,
# beside furnished rooms. Example pictures of both, and how albedo, roughness, metallic, normals and depth gradients are
# distributed, under runs/fig2. The paper shows OpenRooms beside InteriorVerse; neither comes with this project. Where you
# have them in InteriorVerse's layout, name their folders, and their distributions stand beside these.
# It takes five minutes on two cores.
# usage: bash experiments/reproduce/fig2.sh [DIR...]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
install_packages
build clerestory
cd "$root"
mkdir -p runs/fig2
# make NAME OPTION...: 24 rooms, 2 views each, into data/fig2/NAME; pictures of them in runs/fig2/NAME.png.
make() {
  build/clerestory generate --out "data/fig2/$1" --rooms 24 --views 2 --size 320x240 --spp 32 --clamp 1 --no-light \
    --split train --seed 2 --sheet "runs/fig2/$1.png" "${@:2}"
}
make plain --box-rooms
make furnished --roll 5 --close-ups 0.25 --from-above 0.2
build/clerestory data check data/fig2/plain data/fig2/furnished "$@" --report runs/fig2/report.html --json=runs/fig2/figures.json
echo runs/fig2/plain.png runs/fig2/furnished.png runs/fig2/report.html
