#!/usr/bin/env bash
# The Monte Carlo layer beside a grid of 8 x 16 directions under the learned light, error against time.
# minutes: 10
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/layer.toml run.variant=learned study.light=net study.truth_spp=4096 "$@"
