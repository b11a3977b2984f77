#!/usr/bin/env bash
# The pictures of the README, from real photographs: assets/office.jpg (photograph, re-render, three meshes put in, the
# floor made a mirror; albedo, roughness, normals, depth) and meshes in fr3_desk and the garage under runs/pictures.
# usage: bash experiments/reproduce/pictures.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
packages+=(openimageio-tools)
install_packages
build clerestory
cd "$root"
runs=runs/pictures models=assets/models
mirror="--albedo 0.95,0.95,0.95 --roughness 0.02 --metallic 1"
brushed="--albedo 0.9,0.65,0.35 --roughness 0.35 --metallic 1"
plastic="--albedo 0.15,0.35,0.6 --roughness 0.3 --metallic 0"

# take_apart NAME PHOTOGRAPH: a folder of assets/real into a run, which replaces that of an earlier start and all that was
# made from it; put_into NAME OPTION...: objects into that run.
take_apart() {
  build/clerestory invert "assets/real/$1/$2" --camera "assets/real/$1/camera.json" --out "$runs/$1" --force
}
put_into() {
  build/clerestory insert "$runs/$1" --out "$runs/$1/three" --spp 256 "${@:2}"
}

office=assets/real/office
take_apart office rgb.png
put_into office \
  --at 330,405 --mesh $models/bunny.glb --size 0.45 $mirror \
  --at 395,440 --mesh $models/suzi.glb --size 0.35 $brushed \
  --at 285,455 --mesh $models/bunny.glb --size 0.3 $plastic
build/clerestory edit $runs/office --mask $office/floor.png $mirror --spp 256

take_apart fr3_desk rgb.png
put_into fr3_desk \
  --at 60,238 --mesh $models/bunny.glb --size 0.3 $mirror \
  --at 330,242 --mesh $models/suzi.glb --size 0.2 $brushed \
  --at 215,242 --radius 0.07 $plastic

take_apart motorcycle left.png
put_into motorcycle \
  --at 75,420 --mesh $models/bunny.glb --size 0.3 $mirror \
  --at 215,455 --mesh $models/suzi.glb --size 0.25 $brushed \
  --at 440,455 --mesh $models/bunny.glb --size 0.25 $plastic

panels=()
for picture in $office/rgb.png $runs/office/{rerender,three/composite,edit/composite,albedo,roughness,normal,depth}.png; do
  panel=$runs/office/panel$((${#panels[@]} + 1)).png channels=R,G,B
  case $picture in */roughness.png) channels=0,0,0 ;; esac
  oiiotool "$picture" --ch $channels --resize 400x300 -o "$panel"
  panels+=("$panel")
done
oiiotool "${panels[@]}" --mosaic 4x2 --compression jpeg:88 -o assets/office.jpg
echo assets/office.jpg $runs/office/report.html $runs/{fr3_desk,motorcycle}/three/composite.png
