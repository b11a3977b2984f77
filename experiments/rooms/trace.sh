#!/usr/bin/env bash
# Traces the lists of rooms that judge every leg into folders of these names, where the configs of legs look for them.
# usage: bash experiments/rooms/trace.sh [ROOMS [OPTION...]]
# Of each list the first ROOMS, of one that has fewer all; without ROOMS all of 200, 100, three times 64 and 32, which
# takes hours on two cores. --no-light is enough for maps; with it they lie in data/judge, without it in
# data/judge_light. Without light they are larger than nets see them, as rooms that are learned from: a net of 240x180 is
# judged like one of 160x120.
# Those with a number were made by later rules, with cameras rolled and a quarter of the views close up: 2 has matt paint,
# 3 any texture on anything in a quarter of its rooms, and finishes that a thing's kind does not tell.
set -euo pipefail
[[ $# -eq 0 || $1 =~ ^[0-9]+$ ]] || { echo "ROOMS: not a number: $1" >&2 && exit 2; }
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
cd "$root"
install_packages
build clerestory
rooms=("${@:1:1}")
declare -A most=([training]=200 [held_out]=100 [seen]=64 [training_2]=64 [held_out_2]=64 [training_3]=32)
view=(--size 160x120 --spp 64) folder=data/judge_light # light lies at the pixels of its view
[[ " $* " != *" --no-light "* ]] || view=(--size 320x240 --spp 16) folder=data/judge
for list in training held_out seen training_2 held_out_2 training_3; do
  split=test
  [ $list != seen ] || split=train # these rooms are among those that a leg learns from
  clamp=0
  [[ $list != *_[23] ]] || clamp=1 # photographs have no fireflies
  count=("${rooms[@]}")
  [ ${#rooms[@]} -eq 0 ] || [ "${rooms[0]}" -le ${most[$list]} ] || count=(${most[$list]})
  build/clerestory generate --from-rooms experiments/rooms/judge_$list.rooms --out $folder/$list --split $split \
    "${view[@]}" --clamp $clamp "${count[@]/#/--rooms=}" "${@:2}"
done
