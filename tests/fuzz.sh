#!/usr/bin/env bash
# Fuzzes readers of files with libFuzzer under address and undefined-behaviour sanitizers, each from its corpus in
# tests/fuzz/corpus, in build/fuzz, and each for so many seconds of processor time, however busy the machine is. What
# crashes, hangs or takes too much memory is left in build/fuzz/found/TARGET-*: mend it and put the input into the corpus.
#   usage: bash tests/fuzz.sh [SECONDS [TARGET...]]   (60 seconds each)
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
packages+=(clang)
install_packages
cd "$root"
seconds=${1-60}
shift || true
[ -f build/fuzz/build.ninja ] ||
  cmake -S . -B build/fuzz -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=Fuzz \
    -DCMAKE_CXX_FLAGS_FUZZ="-O1 -g1" -DCLERESTORY_FUZZ=ON >/dev/null
if [ $# = 0 ]; then
  for folder in tests/fuzz/corpus/*/; do set -- "$@" "$(basename "$folder")"; done
fi
ninja -C build/fuzz "${@/#/fuzz_}"
mkdir -p build/fuzz/found
# The libraries are not instrumented: containers that cross into them would be taken for overflows.
# Above 2^40 bytes malloc says no, as it does outside; libFuzzer's own limit finds what is large and granted.
export ASAN_OPTIONS=detect_container_overflow=0:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1
export LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0
TMPDIR=$(mktemp -d)
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

spent() { # pid: seconds of processor time; fails when it has ended
  local after_name
  read -ra after_name < <(sed 's/.*) //' "/proc/$1/stat" 2>/dev/null) || return
  echo $(((after_name[11] + after_name[12]) / $(getconf CLK_TCK))) # utime and stime
}
# The driver ends an input that hangs; -timeout would count the time in which others had the processor.
fuzz() { # target
  local pid now unwind=1
  had=0
  mkdir -p "build/fuzz/grown/$1"
  [ "$1" != picture ] || unwind=0 # to see whose a leak is through libraries that have no frame pointers; slow
  ASAN_OPTIONS=$ASAN_OPTIONS:fast_unwind_on_malloc=$unwind build/fuzz/tests/fuzz_"$1" \
    "build/fuzz/grown/$1" "tests/fuzz/corpus/$1" -timeout=0 -rss_limit_mb=2048 -max_len=16384 \
    -print_final_stats=1 -artifact_prefix="build/fuzz/found/$1-" >"$said" 2>&1 &
  pid=$!
  while now=$(spent $pid) && had=$now && [ "$now" -lt "$seconds" ]; do sleep 1; done
  kill -USR2 $pid 2>/dev/null || true # ends after the input that it reads; a device's compiler takes USR1 for itself
  wait $pid
}

failed=()
for target in "$@"; do
  said=build/fuzz/$target.log
  if fuzz "$target"; then
    echo "$target: $had s, $(awk '/number_of_executed_units/ { print $2 }' "$said") inputs, nothing found"
  else
    echo "$target: FOUND, $(grep -m 1 'SUMMARY\|ERROR' "$said" || tail -1 "$said")"
    failed+=("$target")
  fi
done
echo "targets $# found ${#failed[@]}"
[ ${#failed[@]} = 0 ]
