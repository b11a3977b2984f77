#!/usr/bin/env bash
# Fuzzes readers of files with libFuzzer under address and undefined-behaviour sanitizers, each from its corpus in
# tests/fuzz/corpus, in build/fuzz. What crashes, hangs or takes too much memory is left in build/fuzz/found/TARGET-*:
# mend it and put the input into the corpus.   usage: bash tests/fuzz.sh [SECONDS [TARGET...]]   (60 seconds each)
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
export ASAN_OPTIONS=detect_container_overflow=0 UBSAN_OPTIONS=print_stacktrace=1
export LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0
failed=()
for target in "$@"; do
  mkdir -p "build/fuzz/grown/$target"
  said=build/fuzz/$target.log
  if build/fuzz/tests/fuzz_"$target" "build/fuzz/grown/$target" "tests/fuzz/corpus/$target" -max_total_time="$seconds" \
    -timeout=10 -rss_limit_mb=2048 -max_len=16384 -artifact_prefix="build/fuzz/found/$target-" >"$said" 2>&1; then
    echo "$target: $(grep -o 'Done [0-9]* runs in [0-9]* second' "$said")s, nothing found"
  else
    echo "$target: FOUND, $(grep -m 1 'SUMMARY\|ERROR' "$said" || tail -1 "$said")"
    failed+=("$target")
  fi
done
echo "targets $# found ${#failed[@]}"
[ ${#failed[@]} = 0 ]
