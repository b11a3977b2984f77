#!/usr/bin/env bash
# Builds Clerestory and takes a real photograph of an office apart: maps, re-render, a mirror ball put into the room.
# usage: bash experiments/quickstart.sh [PHOTO [invert options]]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
install_packages
build clerestory
if [ $# -gt 0 ]; then # paths are those of whoever calls
  run=$("$root/build/clerestory" invert "$@")
  if [ -d "$run" ]; then echo "The report: $(realpath -- "$run")/report.html"; else echo "$run"; fi
  exit
fi
cd "$root"
office=assets/real/office
run=runs/invert/office
for ((n = 2; ; ++n)); do  # a second start leaves the first one's run, and what was made from it, alone
  [ -e "$run" ] || break
  run=runs/invert/office-$n
done
build/clerestory invert "$office/rgb.png" --camera "$office/camera.json" --out "$run" >/dev/null  # it prints its folder
build/clerestory insert "$run" --at 330,400 --radius 0.25 --albedo 0.95,0.95,0.95 --roughness 0.02 --metallic 1 >/dev/null
echo "The report: $root/$run/report.html"
