#!/usr/bin/env bash
# Tests of host code under sanitizers, without arguments address and undefined behaviour, in build/sanitized: what
# computes nothing on a device, and the graph. With `thread`, in build/threads: report and graph, and the commands whose
# own threads trace rooms, read views, write files and wait for signals. -O0 and lines alone compile in a fifth of the
# time of -O2 -g.   usage: bash tests/sanitized.sh [thread]
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
cd "$root"
kind=${1-address}
said=$(mktemp)
work=$(mktemp -d)
trap 'rm -rf "$said" "$work"' EXIT
export UBSAN_OPTIONS=print_stacktrace=1

configure() { # folder, sanitizers
  [ -f "$1/build.ninja" ] ||
    cmake -S . -B "$1" -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-g1 -DCLERESTORY_SANITIZE="$2" >/dev/null
}
quieter() { tee "$said" | grep -v -e '^\[ RUN' -e '^\[       OK'; }

address() {
  local suite suites=(math io report graph)
  configure build/sanitized address,undefined
  ninja -C build/sanitized "${suites[@]/#/test_}"
  export LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0
  # LeakSanitizer stops all threads to look at them, and now and then falls over itself, "Tracer caught signal 11", where
  # a driver's thread is just ending. Then, and only then, a suite runs once more without it, and says so.
  for suite in "${suites[@]}"; do
    run "$suite" && continue
    grep -q 'LeakSanitizer has encountered a fatal error' "$said" || exit 1
    echo "test_$suite once more: LeakSanitizer failed, not the tests; leaks are not looked for"
    run "$suite" :detect_leaks=0
  done
}
run() { # suite, more options
  local unwind=1
  [ "$1" != io ] || unwind=0 # to see through libraries of pictures, which have no frame pointers; slow where LLVM works
  ASAN_OPTIONS=fast_unwind_on_malloc=$unwind${2-} build/sanitized/tests/test_"$1" 2>&1 | quieter
}

# The libraries are not instrumented: what only they do is suppressed by their names in tests/threads.supp.
thread() {
  local suite program=build/threads/clerestory view
  configure build/threads thread
  ninja -C build/threads clerestory test_report test_graph
  export TSAN_OPTIONS="suppressions=$root/tests/threads.supp halt_on_error=0 exitcode=66 second_deadlock_stack=1"
  for suite in report graph; do build/threads/tests/test_$suite 2>&1 | quieter; done
  for split in train val; do
    $program generate --out "$work/$split" --rooms 1 --views 2 --size 32x32 --spp 2 --light-spp 1 --probes 1 --box-rooms \
      --split $split --seed ${#split} -q
  done
  $program train experiments/configs/mgnet_compact.toml data.train="[$work/train]" data.validation="[$work/val]" \
    model.growth=4 model.first=16 "model.layers=[1,1,1,1]" "model.decoder=[32,16,16,8,4]" model.width=32 model.height=32 \
    train.batch=2 train.steps=12 train.minutes=0 log.checkpoint_every=4 stream.setting=training stream.times=4 \
    stream.window=2 stream.views=1 stream.spp=1 stream.scale=1 stream.fixed=0.2 stream.crop=0.8 run.root="$work/runs"
  view=$(echo "$work"/train/*/000_im.exr)
  $program invert "$view" --gbuffer "${view%_im.exr}" --light image --spp 2 --out "$work/run" -q
  $program insert "$work/run" --at 16,24 --radius 0.1 --light image --spp 2 -q
  echo "threads: no race in report, graph, generate, train, invert, insert"
}

case $kind in
  address | thread) "$kind" ;;
  *) echo "usage: bash tests/sanitized.sh [thread]" >&2 && exit 2 ;;
esac
