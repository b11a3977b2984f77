#!/usr/bin/env bash
# Tests of host code built with sanitizers. address (and undefined behaviour), in build/sanitized: what computes nothing
# on a device, and the graph. thread, in build/sanitized_thread: what has threads of its own or locks against those of
# others. -O0 and lines alone compile in a fifth of the time of -O2 -g.   usage: bash tests/sanitized.sh [address|thread]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
cd "$root"
kind=${1-address}
case $kind in
  address) folder=build/sanitized sanitizers=address,undefined suites=(math io report graph) ;;
  thread) folder=build/sanitized_thread sanitizers=thread suites=(report cl tuning experiments) ;;
  *) echo "usage: bash tests/sanitized.sh [address|thread]" >&2; exit 2 ;;
esac
[ -f $folder/build.ninja ] ||
  cmake -S . -B $folder -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-g1 \
    -DCLERESTORY_SANITIZE=$sanitizers >/dev/null
ninja -C $folder "${suites[@]/#/test_}"
export LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS=suppressions=$root/tests/threads.supp:print_suppressions=0
said=$(mktemp)
trap 'rm -f "$said"' EXIT

run() { # suite, more options
  local unwind=1 filter=*
  [ "$1" != io ] || unwind=0 # to see through libraries of pictures, which have no frame pointers; slow where LLVM works
  # One starts a thread after a fork, which TSan ends ("dup thread"); one asks for microseconds.
  [ $kind != thread ] || filter=-InterruptTest.*:DeviceTest.LookingAKernelUpIsCheap
  [ "$1" != experiments ] || filter=RoomStreamTest.*:TrainingData.*:Photo.*
  ASAN_OPTIONS=fast_unwind_on_malloc=$unwind${2-} $folder/tests/test_"$1" --gtest_filter="$filter" 2>&1 | tee "$said" |
    grep -v -e '^\[ RUN' -e '^\[       OK'
}
# LeakSanitizer stops all threads to look at them, and now and then falls over itself, "Tracer caught signal 11", where a
# driver's thread is just ending. Then, and only then, a suite runs once more without it, and says so.
for suite in "${suites[@]}"; do
  run "$suite" && continue
  grep -q 'LeakSanitizer has encountered a fatal error' "$said" || exit 1
  echo "test_$suite once more: LeakSanitizer failed, not the tests; leaks are not looked for"
  run "$suite" :detect_leaks=0
done
