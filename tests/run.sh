#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test.   usage: bash tests/run.sh [ctest arguments]
# CTest has an entry for each suite; the last lines name the cases that did not pass and count all. One case alone:
#   build/tests/test_ops --gtest_filter=Sobol.FillsElementaryIntervals
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
build
cd "$root/build"
log=Testing/Temporary/LastTest.log

# Names of the cases whose lines in CTest's log begin with [ $1 ].
cases() { sed -nE "s/^\[ *$1 *\] ([^ ,]+\.[^ ,]+)( \(.*)?$/\1/p" "$log" | sort -u; }
count_cases() {
  local skipped
  comm -23 <(cases RUN) <(sort -u <(cases OK) <(cases SKIPPED)) | sed 's/^/not passed: /' # failed, or ended by a crash
  printf '%d of %d test cases passed' "$(cases OK | wc -l)" "$(cases RUN | wc -l)"
  skipped=$(cases SKIPPED | wc -l)
  ((skipped == 0)) || printf ', %d skipped' "$skipped"
  printf '\n'
}

rm -f "$log"
status=0
ctest --output-on-failure -j"$(nproc)" "$@" || status=$?
if grep -qs '^\[ RUN ' "$log"; then count_cases; fi # tests may only have been listed
exit "$status"
