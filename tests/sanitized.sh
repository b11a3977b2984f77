#!/usr/bin/env bash
# The tests of what computes nothing on a device, host code built with address and undefined-behaviour sanitizers, in
# build/sanitized.   usage: bash tests/sanitized.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
cd "$root"
[ -f build/sanitized/build.ninja ] ||
  cmake -S . -B build/sanitized -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCLERESTORY_SANITIZE=ON >/dev/null
suites=(math io report)
ninja -C build/sanitized "${suites[@]/#/test_}"
for suite in "${suites[@]}"; do build/sanitized/tests/test_"$suite" --gtest_brief=1; done
