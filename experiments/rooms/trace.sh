#!/usr/bin/env bash
# Traces the lists of rooms that judge every leg into data/judge/NAME, where the configs of legs look for them.
# usage: bash experiments/rooms/trace.sh [ROOMS]     of each list the first ROOMS; without, all: an hour on two cores
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
cd "$root"
install_packages
build clerestory
for list in training held_out seen; do
  split=test
  [ $list != seen ] || split=train # these rooms are among those that a leg learns from
  build/clerestory generate --from-rooms experiments/rooms/judge_$list.h5 --out data/judge/$list --split $split \
    --size 160x120 --spp 64 ${1:+--rooms "$1"}
done
