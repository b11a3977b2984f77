#!/usr/bin/env bash
# Which link limits the learned light: hits, light in view, light out of view, maps.
# minutes: 60
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/oracle_ladder.toml "$@"
