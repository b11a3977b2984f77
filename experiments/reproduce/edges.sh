#!/usr/bin/env bash
# How sharp predicted maps are: their error along edges, beside true maps of a small size brought back.
# minutes: 10
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
result experiments/configs/edges.toml "$@"
