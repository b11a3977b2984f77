#!/usr/bin/env bash
# Balls put into rooms, what they do to the room, and the light at their centres, by light.
# minutes: 60
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/balls.toml
