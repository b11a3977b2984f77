#!/usr/bin/env bash
# An error asked for of a re-render, the one that it measures, and the one that it has.
# minutes: 10
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/target_error.toml "$@" -- --table target
