#!/usr/bin/env bash
# What a re-render leaves out for what its scene lacks: seconds with and without it, and its error.
# minutes: 10
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/leave_out.toml "$@" -- --table leave_out
