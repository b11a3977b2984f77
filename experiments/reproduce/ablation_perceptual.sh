#!/usr/bin/env bash
# Whether a perceptual term sharpens the edges of maps, and through whose features: random ones or those of our rooms.
# minutes: 150
# usage: bash experiments/reproduce/ablation_perceptual.sh [KEY=VALUE...]
#   train.steps=0 train.minutes=2    equally long trainings in place of equally many steps
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/ablation_perceptual.toml "$@" -- --table edges
