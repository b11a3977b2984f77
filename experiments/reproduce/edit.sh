#!/usr/bin/env bash
# Materials replaced in rooms, beside the tracer's rooms, by light.
# minutes: 20
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/edit.toml "$@"
