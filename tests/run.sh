#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test.   usage: bash tests/run.sh [ctest arguments]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
build
cd "$root/build"
exec ctest --output-on-failure -j"$(nproc)" "$@"
