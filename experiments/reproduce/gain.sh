#!/usr/bin/env bash
# What the light out of view is multiplied by, chosen on rooms on which nothing is judged.
# minutes: 13
# usage: bash experiments/reproduce/gain.sh [KEY=VALUE...]
#   light.weights=DIR     of other weights; `clerestory weights export DIR DIR --gain NUMBER` then says it in them
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/gain.toml -m light.gain=1,1.4,1.8,2.3,3 "$@" -- --table 1_user --plot "mirror ball"
