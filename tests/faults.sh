#!/usr/bin/env bash
# What befalls a program that works for hours, done to train, generate, run and invert: they are killed (kill -9,
# SIGINT, SIGTERM) at random moments, the disk fills up or cannot be written, two of them want one folder, memory is
# short, checkpoints are cut short, devices have less or are lost. Nothing that was finished may be lost or changed, and
# the same command must go on to the results of an unbroken run, or say why not. Disks that are full or read-only need
# root, to be mounted.
#   bash tests/faults.sh [SEED [CASE...]]    cases: kills signals full read_only two memory damaged less lost
set -uo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
packages+=(gdb) # says whose code ended for want of memory
install_packages
clerestory=$root/build/clerestory
[ -x "$clerestory" ] || { echo "$clerestory is missing: bash tests/run.sh" >&2; exit 1; }
RANDOM=${1-1}
shift || true
[ $# -gt 0 ] || set -- kills signals full read_only two memory damaged less lost
commands=(train generate run invert)
work=$(mktemp -d)
found=0
clean_up() {
  local job
  for job in $(jobs -p); do kill -KILL "$job" 2>/dev/null; done
  ! mountpoint -q "$work/disk" || umount "$work/disk"
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 1' INT TERM
cd "$work"

# A fault of the program: said with what it said last.
find_fault() { # what, file of what was said
  found=$((found + 1))
  echo "FOUND: $1"
  [ $# -lt 2 ] || sed 's/^/    /' "$2" | tail -n 5
}

# --- The commands, very small ---------------------------------------------------------------------------------------

# Sets line: COMMAND with its results in FOLDER.
line_of() { # command, folder
  case $1 in
    train) line=(train tiny.toml "run.root=$2") ;;
    generate)
      line=(generate --out "$2/rooms" --rooms 2 --views 3 --size 20x16 --spp 4 --light-spp 1 --probes 1 --box-rooms
        --seed 5)
      ;;
    run) line=(run "$root/experiments/configs/layer.toml" "run.root=$2" data.rooms=1 data.width=32 data.height=24
      "study.spp=[4,16]" study.truth_spp=64 study.seeds=2 -m data.seed=1,2) ;;
    invert) line=(invert "$view"_im.exr --gbuffer "$view" --light image --spp "${samples-16}" --out "$2/run") ;;
  esac
  line=("$clerestory" "${line[@]}")
}

# Of each result one line, the hash of what must be the same and its name: of weights and pictures all but the times.
tensors_hash() { # file
  local header
  header=$(od -An -tu8 -N8 "$1" | tr -d ' ')
  tail -c +$((9 + header)) "$1" | sha256sum | cut -d' ' -f1
}
# A study's errors, but for what it renders in a given time.
errors_hash() { # run
  grep -v 'equal/' "$1/metrics.jsonl" | sed 's/"[a-z0-9/]*seconds":[^,]*,//g' | sha256sum | cut -d' ' -f1
}
results_of() { # command, folder
  local file
  case $1 in
    train)
      for file in "$2"/*/*/artifacts/*.safetensors; do
        [ ! -e "$file" ] || echo "$(tensors_hash "$file") ${file##*/}"
      done
      ;;
    generate) (cd "$2/rooms" && find . -type f -exec sha256sum {} +) ;;
    run)
      for file in "$2"/*/main-*/DONE; do
        [ ! -e "$file" ] || echo "$(errors_hash "${file%/*}") $(basename "${file%/*}")"
      done
      ;;
    invert) (cd "$2/run" && sha256sum ./*.exr camera.json) ;;
  esac 2>/dev/null | sort
}

# What an interrupted command left: files that are finished are those of the unbroken run.
check_finished() { # command, folder, what happened
  local file
  case $1 in
    generate | run)
      results_of "$1" "$2" | grep -v '\.tmp$\|\.lock$\|\.txt$' | comm -23 - "results.$1" >differs
      [ ! -s differs ] || find_fault "$1, $3: what is finished is not that of an unbroken run" differs
      ;;
    invert)
      [ -d "$2/run" ] || return 0
      results_of invert "$2" | cmp -s - before || results_of invert "$2" | cmp -s - results.invert ||
        find_fault "invert, $3: the run is neither the old one nor the new one"
      ;;
    train)
      for file in "$2"/*/*/checkpoints/step-*.safetensors; do
        [ ! -e "$file" ] || "$clerestory" weights inspect "$file" >said.inspect 2>&1 ||
          find_fault "train, $3: a checkpoint that cannot be read" said.inspect
      done
      ;;
  esac
}

# Runs a command to its end: the results of the unbroken run, and nothing else.
must_end_well() { # command, folder, after what
  line_of "$1" "$2"
  "${line[@]}" >"said.$1" 2>&1 || { find_fault "$1, gone on with after $3: exit code $?" "said.$1"; return; }
  results_of "$1" "$2" | cmp -s - "results.$1" || find_fault "$1, gone on with after $3: other results" "said.$1"
  [ -z "$(find "$2" -name '*.tmp' -o -name '*.partial' -o -name '*.old' -o -name stream)" ] ||
    find_fault "$1, gone on with after $3: something was left behind: $(find "$2" -name '.*' | head -n 3)"
}

prepare() {
  local split name began
  for split in train val; do
    "$clerestory" generate --out "$split" --rooms 1 --views 2 --size 32x32 --spp 2 --box-rooms --no-light \
      --split $split --seed ${#split} -q || exit 1
  done
  view=$(echo train/*/000_im.exr)
  view=$work/${view%_im.exr}
  cat >tiny.toml <<'TOML'
[data]
train = ["train"]
validation = ["val"]
[model]
growth = 4
first = 16
layers = [1, 1, 1, 1]
decoder = [32, 16, 16, 8, 4]
width = 32
height = 32
[train]
batch = 1
steps = 120
[log]
checkpoint_every = 5
validate_every = 30
TOML
  for name in "${commands[@]}" "${commands[@]}"; do # twice: kernels are built in the first one
    rm -rf "whole/$name"
    mkdir -p "whole/$name"
    line_of "$name" "whole/$name"
    began=$(date +%s%N)
    "${line[@]}" >"said.$name" 2>&1 || { cat "said.$name" >&2; exit 1; }
    lasts[$name]=$((($(date +%s%N) - began) / 1000000))
    results_of "$name" "whole/$name" >"results.$name"
    [ -s "results.$name" ] || { echo "$name has no results" >&2; exit 1; }
  done
  samples=4
  line_of invert before_run
  "${line[@]}" -q >said.invert 2>&1 || exit 1 # what invert replaces
  samples=16
  results_of invert before_run >before
}

# An empty folder; for invert one with an earlier run.
begin() { # command, folder
  rm -rf "$2"
  mkdir -p "$2"
  [ "$1" != invert ] || cp -a before_run/run "$2/run"
}

# Starts a command and sends a signal after a random part of the time that it takes; sets code.
signalled() { # command, folder, signal
  local pause=$((RANDOM % (${lasts[$1]} + 1)))
  line_of "$1" "$2"
  "${line[@]}" >"said.$1" 2>&1 &
  sleep "$((pause / 1000)).$(printf %03d $((pause % 1000)))"
  kill "-$3" $! 2>/dev/null
  wait $! 2>/dev/null
  code=$?
}

# --- What befalls them ------------------------------------------------------------------------------------------------

kills() {
  local made=0 name newest before
  declare -A count
  for name in "${commands[@]}"; do begin "$name" "killed/$name"; done
  while [ $made -lt 50 ]; do
    for name in "${commands[@]}"; do
      before=$(ls "killed/$name"/*/*/checkpoints 2>/dev/null | tail -n 1)
      signalled "$name" "killed/$name" KILL
      case $code in
        137)
          made=$((made + 1))
          count[$name]=$((${count[$name]-0} + 1))
          check_finished "$name" "killed/$name" "killed"
          newest=$(ls "killed/$name"/*/*/checkpoints 2>/dev/null | tail -n 1)
          [[ ! "$newest" < "$before" ]] || find_fault "$name, killed: a checkpoint was lost: $before, now $newest"
          ;;
        0)
          must_end_well "$name" "killed/$name" "kills"
          begin "$name" "killed/$name"
          ;;
        *) find_fault "$name, gone on with after kills: exit code $code" "said.$name" ;;
      esac
    done
  done
  for name in "${commands[@]}"; do must_end_well "$name" "killed/$name" "kills"; done
  echo "kills: $made (train ${count[train]} generate ${count[generate]} run ${count[run]} invert ${count[invert]})"
}

signals() {
  local name number ended=0 stopped=0 early=0 round
  for name in "${commands[@]}"; do
    for number in INT TERM; do
      begin "$name" "signals/$name"
      for round in 1 2 3; do
        signalled "$name" "signals/$name" $number
        case $code in
          4)
            stopped=$((stopped + 1))
            [ -z "$(find "signals/$name" -name '*.tmp' -o -name '*.partial' -o -name '.*.lock')" ] ||
              find_fault "$name, SIG$number: something was left behind" "said.$name"
            ;;
          0) ended=$((ended + 1)) ;;
          130 | 143) early=$((early + 1)) ;; # before it began
          *) find_fault "$name, SIG$number: exit code $code" "said.$name" ;;
        esac
        check_finished "$name" "signals/$name" "SIG$number"
      done
      must_end_well "$name" "signals/$name" "SIG$number"
    done
  done
  [ $stopped -gt 0 ] || find_fault "no command was ever stopped"
  echo "signals: $((stopped + ended + early)) ($stopped stopped, $early before they began, $ended after their end)"
}

mount_disk() { # KiB
  mkdir -p disk
  mount -t tmpfs -o "size=$1k" tmpfs disk
}
as_root() { # case
  [ "$(id -u)" = 0 ] || { echo "$1: left out, needs root"; return 1; }
}

# Of the space that a command needs there is a tenth, and so on up to nearly all.
full() {
  local name share needed begun=0 refused=0
  as_root full || return 0
  for name in "${commands[@]}"; do
    for share in 10 40 70 90 97; do
      needed=$(du -sk "whole/$name" | cut -f1)
      [ "$name" != invert ] || needed=$((2 * needed)) # the old one stays until the new one is whole
      mount_disk $((needed * share / 100 + 16))
      begin "$name" "disk/$name" 2>/dev/null || { umount disk; continue; } # the old run alone fills it
      line_of "$name" "disk/$name"
      "${line[@]}" >"said.$name" 2>&1
      code=$?
      begun=$((begun + 1))
      case $code in
        0) ;;
        1 | 2)
          refused=$((refused + 1))
          grep -q 'No space left on device' "said.$name" || find_fault "$name, full disk: does not say why" "said.$name"
          grep -q "disk/$name" "said.$name" || find_fault "$name, full disk: does not say where" "said.$name"
          ;;
        *) find_fault "$name, full disk: exit code $code" "said.$name" ;;
      esac
      check_finished "$name" "disk/$name" "full disk"
      mount -o remount,size=200m disk
      must_end_well "$name" "disk/$name" "a full disk ($share %)"
      umount disk
    done
  done
  [ $refused -gt 10 ] || find_fault "only $refused of $begun commands met a full disk"
  for name in --version 'devices --json'; do
    "$clerestory" $name >/dev/full 2>said.full
    code=$?
    [ $code = 1 ] || find_fault "$name into a full disk: exit code $code" said.full
  done
  echo "full: $refused of $begun commands met a full disk"
}

# Results are read from a disk that cannot be written, and not written there.
read_only() {
  local name
  as_root read_only || return 0
  mount_disk 200000
  for name in "${commands[@]}"; do cp -a "whole/$name" "disk/$name"; done
  cp -a whole/invert/run disk/made
  mkdir disk/empty
  mount -o remount,ro disk
  for name in "${commands[@]}"; do
    for folder in disk/empty "disk/$name"; do
      line_of "$name" $folder
      "${line[@]}" >"said.$name" 2>&1
      code=$?
      [ $code = 0 ] && [ $folder != disk/empty ] && grep -q 'finished\|nothing to do' "said.$name" && continue
      [ $code = 2 ] || { [ "$name" = run ] && [ $code = 1 ]; } || # a sweep, whose runs failed
        find_fault "$name, read-only folder $folder: exit code $code" "said.$name"
      grep -q "Read-only file system" "said.$name" ||
        find_fault "$name, read-only folder: does not say why" "said.$name"
    done
    results_of "$name" "disk/$name" | cmp -s - "results.$name" ||
      find_fault "$name, read-only folder: results changed"
  done
  "$clerestory" insert disk/made --at 16,24 --radius 0.1 --light image --spp 2 --out inserted -q >said.insert 2>&1 ||
    find_fault "insert of a run that is read-only" said.insert
  "$clerestory" light disk/made --at 16,24 --size 16x8 --light image --out light.exr -q >said.light 2>&1 ||
    find_fault "light of a run that is read-only" said.light
  "$clerestory" data check disk/generate/rooms --json -q >checked 2>&1 # 1: two lists name no room
  "$clerestory" data check whole/generate/rooms --json -q >there 2>&1
  sed 's/whole/disk/' there | diff - checked >differs ||
    find_fault "data check of rooms that are read-only" differs
  umount disk
  echo "read_only: done"
}

# A second process is told who works there, and disturbs nobody.
two() {
  local name first told
  for name in "${commands[@]}"; do
    begin "$name" "two/$name"
    line_of "$name" "two/$name"
    told=two/$name/*/*/.lock
    case $name in
      generate) told=two/generate/rooms/generate.json ;;
      invert) told=two/invert/.run.lock ;;
    esac
    "${line[@]}" >said.first 2>&1 &
    first=$!
    until [ -s "$(echo $told | cut -d' ' -f1)" ] || ! kill -0 $first 2>/dev/null; do :; done
    kill -STOP $first
    "${line[@]}" >"said.$name" 2>&1
    code=$?
    kill -CONT $first
    wait $first || find_fault "$name, disturbed by a second process: exit code $?" said.first
    results_of "$name" "two/$name" | cmp -s - "results.$name" ||
      find_fault "$name, beside a second process: other results"
    case $name in
      generate) [ $code = 0 ] ;; # shares the work
      run) [ $code = 4 ] && grep -q "pid $first" said.run ;;
      *) [ $code = 2 ] && grep -q "pid $first" "said.$name" ;;
    esac || find_fault "$name, a second process: exit code $code" "said.$name"
  done
  echo "two: ${#commands[@]} commands"
}

# Whose code a signal ended, as the file core says it: a library or the program. What C and C++ themselves are made of
# only passes it on.
owner_of_core() {
  gdb -batch -ex 'python
frame = gdb.newest_frame()
of_language = ("libc.so", "libstdc++.so", "libgcc_s.so", "libm.so", "ld-linux")
while frame and any(name in (gdb.solib_name(frame.pc()) or "") for name in of_language):
  frame = frame.older()
print("owner:", gdb.solib_name(frame.pc()) or "clerestory" if frame else "nobody")' "$clerestory" core 2>/dev/null |
    sed -n 's/^owner: //p'
}
# Address space from what the libraries just start in up to enough. Drivers abort without memory, or read what they did
# not get; ours must say so, and nothing may be lost.
memory() {
  local name mib owner ended=0 refused=0 aborted=0
  for name in "${commands[@]}"; do
    begin "$name" "memory/$name"
    for mib in 400 450 500 550 600 700 705 710 715 800 1000 1300 1600; do
      (ulimit -v $((mib * 1024)) && exec "$clerestory" --version) >/dev/null 2>&1 || continue
      line_of "$name" "memory/$name"
      rm -f core
      (ulimit -c unlimited && ulimit -v $((mib * 1024)) && exec "${line[@]}") >"said.$name" 2>&1
      code=$?
      case $code in
        0) ended=$((ended + 1)) ;;
        1 | 2 | 3)
          refused=$((refused + 1))
          [ -s "said.$name" ] || find_fault "$name in $mib MiB: says nothing"
          ;;
        *)
          aborted=$((aborted + 1))
          owner=$(owner_of_core)
          case $owner in
            */lib*) echo "memory: $name in $mib MiB is ended by $(basename "$owner")" ;;
            *) find_fault "$name in $mib MiB: exit code $code in ${owner:-an unknown place: no core}" "said.$name" ;;
          esac
          ;;
      esac
      check_finished "$name" "memory/$name" "$mib MiB"
    done
    must_end_well "$name" "memory/$name" "short memory"
  done
  echo "memory: $((ended + refused + aborted)) ($refused refused, $aborted ended by a library, $ended had enough)"
}

# A checkpoint, or what lies beside it, is empty or cut in half.
damaged() {
  local run newest before file size cases=0
  begin train damaged/train
  must_end_well train damaged/train nothing
  run=$(echo damaged/train/*/*)
  newest=$(ls "$run"/checkpoints/step-* | tail -n 1)
  before=$(ls "$run"/checkpoints/step-* | tail -n 2 | head -n 1)
  cp -a "$run" intact
  cut_file() { truncate -s "$2" "$run/$1" && rm "$run/DONE"; }
  again() { rm -rf "$run" && cp -a intact "$run"; }
  for file in "${newest#"$run"/}" log.txt metrics.jsonl provenance.json report.html \
    artifacts/weights.safetensors; do
    for size in 0 half; do
      [ $size = 0 ] || size=$(($(stat -c %s "$run/$file") / 2))
      cut_file "$file" "$size"
      cases=$((cases + 1))
      must_end_well train damaged/train "$file of $size bytes"
      again
    done
  done
  line_of train damaged/train
  cut_file config.resolved.toml 0
  "${line[@]}" >said.train 2>&1
  code=$?
  [ $code = 2 ] && grep -q config.resolved.toml said.train ||
    find_fault "train, an empty config: exit code $code" said.train
  again
  # The best weights are lost: it says so, and ends in weights that can be read.
  cut_file artifacts/best.safetensors 1000
  "${line[@]}" >said.train 2>&1
  code=$?
  [ $code = 0 ] && grep -q 'best.safetensors.*lost' said.train ||
    find_fault "train, best weights cut: exit code $code" said.train
  "$clerestory" weights inspect "$run/artifacts/weights.safetensors" >said.train 2>&1 ||
    find_fault "train, best weights cut: damaged weights" said.train
  again
  # All checkpoints: it says so, sets them aside, and the same command begins anew.
  truncate -s 0 "$newest" "$before" && rm "$run/DONE"
  line_of train damaged/train
  "${line[@]}" >said.train 2>&1
  code=$?
  [ $code = 2 ] && grep -q 'begins anew' said.train ||
    find_fault "train, all checkpoints empty: exit code $code" said.train
  must_end_well train damaged/train "all checkpoints were empty"
  # What generate has finished is not looked into again, but is told from what is damaged.
  cp -a whole/generate damaged/generate
  file=$(ls damaged/generate/rooms/*/000_depth.exr | head -n 1)
  truncate -s 0 "$file"
  "$clerestory" data check damaged/generate/rooms >said.data 2>&1
  code=$?
  [ $code != 0 ] && grep -q "${file##*/}" said.data ||
    find_fault "data check of an empty map: exit code $code" said.data
  # Maps of a run: who reads it names the file.
  cp -a whole/invert damaged/invert
  for file in depth.exr camera.json photo.exr provenance.json; do
    for size in 0 50; do
      cp -a "whole/invert/run/$file" "damaged/invert/run/$file"
      truncate -s $size "damaged/invert/run/$file"
      cases=$((cases + 1))
      "$clerestory" insert damaged/invert/run --at 16,24 --radius 0.1 --light image --spp 2 -q >said.insert 2>&1
      code=$?
      [ $code = 2 ] && grep -q "$file" said.insert ||
        find_fault "insert, $file of $size bytes: exit code $code" said.insert
    done
    cp -a "whole/invert/run/$file" "damaged/invert/run/$file"
  done
  echo "damaged: $((cases + 4)) files"
}

# On devices that have less the results are the same, or it is said what is too small. (Less local memory is another
# order of sums, with other roundings.)
less() {
  local name what same=0 refused=0
  for name in "${commands[@]}"; do
    for what in no_fp64,no_unified_memory max_group=64 max_group=1 max_allocation=1 memory=1; do
      begin "$name" "less/$name"
      line_of "$name" "less/$name"
      CLERESTORY_PRETEND=$what "${line[@]}" >"said.$name" 2>&1
      code=$?
      case $code in
        0)
          same=$((same + 1))
          results_of "$name" "less/$name" | cmp -s - "results.$name" ||
            find_fault "$name with $what: other results" "said.$name"
          ;;
        3) refused=$((refused + 1)) ;;
        *)
          [ "$name" = run ] && [ $code = 1 ] && grep -q 'on pthread' said.run && refused=$((refused + 1)) ||
            find_fault "$name with $what: exit code $code" "said.$name"
          ;;
      esac
      must_end_well "$name" "less/$name" "$what"
    done
  done
  echo "less: $((same + refused)) ($same with the same results, $refused refused)"
}

# The device is lost after a random number of launches.
lost() {
  local name round most count=0
  declare -A launches=([train]=20000 [generate]=200 [run]=400 [invert]=60)
  for name in "${commands[@]}"; do
    begin "$name" "lost/$name"
    for round in 1 2 3 4; do
      most=${launches[$name]}
      line_of "$name" "lost/$name"
      CLERESTORY_PRETEND=lost_after=$((RANDOM * RANDOM % most)) "${line[@]}" >"said.$name" 2>&1
      code=$?
      case $code in
        0) ;;
        1 | 3)
          [ "$name" = run ] || [ $code = 3 ] || find_fault "$name, device lost: exit code $code" "said.$name"
          count=$((count + 1))
          grep -q CL_DEVICE_NOT_AVAILABLE "said.$name" ||
            find_fault "$name, device lost: does not say so" "said.$name"
          [ "$name" != train ] || grep -q 'the same command' said.train ||
            find_fault "train, device lost: does not say what stays" said.train
          ;;
        *) find_fault "$name, device lost: exit code $code" "said.$name" ;;
      esac
      check_finished "$name" "lost/$name" "device lost"
    done
    must_end_well "$name" "lost/$name" "a lost device"
  done
  [ $count -gt 4 ] || find_fault "only $count of 16 devices were lost"
  echo "lost: $count devices"
}

declare -A lasts
samples=16
prepare
for case in "$@"; do "$case"; done
echo "faults found $found"
[ $found = 0 ]
