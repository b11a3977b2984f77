#!/usr/bin/env bash
# The layer under true light beside the tracer, and the lights that a photograph allows.
# minutes: 4
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/truth.toml "$@" -- --table lights
