#!/usr/bin/env bash
# Mirror objects under the maps and the light of both side-by-side trainings, ours and Li et al.'s, beside the photograph.
# minutes: 60
# usage: bash experiments/reproduce/side_by_side_objects.sh [KEY=VALUE...]
#   data.rooms=4          fewer rooms
# Takes the newest nets of the first seed of side_by_side_maps.sh and side_by_side_light.sh, of each the best validation's,
# and runs these where there are none. They are exported as two methods, runs/side_by_side/ours and runs/side_by_side/li2020.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
prepare

# What the newest training of a variant's maps or light left; nothing where there is none.
newest() { # variant, maps or light
  [ ! -d runs/results ] || find runs/results -path "*/side_by_side_$2/$1-*-s1/artifacts/weights.safetensors" -printf '%T@ %p\n' |
    sort -n | tail -n 1 | cut -d ' ' -f 2-
}

trained() { # variant, maps or light
  [ -n "$(newest "$@")" ] || bash "experiments/reproduce/side_by_side_$2.sh" >&2 || return
  newest "$@"
}

# Both as a method's folder.
export_method() { # variant
  local folder=runs/side_by_side/$1 maps light
  maps=$(trained "$1" maps)
  light=$(trained "$1" light)
  mkdir -p "$folder"
  build/clerestory weights export "$maps" "$folder/maps.safetensors" >&2
  build/clerestory weights export "$light" "$folder" >&2
}
export_method ours
export_method li2020
result experiments/configs/fig6.toml run.experiment=side_by_side_objects study.method=runs/side_by_side/ours \
  study.rival=runs/side_by_side/li2020 'objects.lights=["net", "image", "constant"]' "$@" -- --table 1_objects --plot "PSNR as shown"
