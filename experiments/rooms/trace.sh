#!/usr/bin/env bash
# Traces the lists of rooms that judge every leg into data/judge/NAME, where the configs of legs look for them.
# usage: bash experiments/rooms/trace.sh [ROOMS [OPTION...]]
# Of each list the first ROOMS, or all of 200, 100 and 64: two hours on two cores, with --no-light, enough for maps, one.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
cd "$root"
install_packages
build clerestory
rooms=("${@:1:1}")
for list in training held_out seen; do
  split=test
  [ $list != seen ] || split=train # these rooms are among those that a leg learns from
  build/clerestory generate --from-rooms experiments/rooms/judge_$list.h5 --out data/judge/$list --split $split \
    --size 160x120 --spp 64 "${rooms[@]/#/--rooms=}" "${@:2}"
done
