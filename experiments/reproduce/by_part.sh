#!/usr/bin/env bash
# Seconds of a re-render to an error of 0.01: a plain estimator, each part of ours alone, all of them.
# minutes: 8
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/by_part.toml "$@" -- --table by_part
