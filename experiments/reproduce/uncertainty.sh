#!/usr/bin/env bash
# Whether u knows false hits of screen-space ray tracing, and its constant swept.
# minutes: 45
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/uncertainty.toml "$@"
