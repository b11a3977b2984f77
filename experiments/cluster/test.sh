#!/usr/bin/env bash
# Tries parallel.sh and slurm.sh with the real programs on this one machine: a sweep of 12 very small trainings by one
# process, by GNU parallel and by a Slurm of its own (munged, slurmctld and slurmd, stopped in the end); the latter two
# are killed in the middle and gone on with. All three must end in the same table, but for its times. Not part of ctest:
#   apt-get install parallel slurm-wlm munge; usage: bash experiments/cluster/test.sh [parallel] [slurm]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
for program in parallel slurmctld slurmd munged python3; do
  command -v $program >/dev/null || { echo "$program is missing: apt-get install parallel slurm-wlm munge python3" >&2; exit 1; }
done
work=$(mktemp -d)
daemons=() # of the Slurm of ours, in the order of their start
clean_up() {
  local i
  if [ ${#daemons[@]} -gt 0 ]; then
    timeout 10 scancel --user="$(id -un)" || true
    for ((i = 0; i < 100; i++)); do queue_empty || sleep 0.1; done
    for ((i = ${#daemons[@]} - 1; i >= 0; i--)); do kill "${daemons[i]}" && wait "${daemons[i]}" || true; done
  fi 2>/dev/null
  cd /
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 1' INT TERM
cd "$work"

fail() { echo "FAILED: $*" >&2; exit 1; }
sweep() { # folder of its runs
  echo "$root/build/clerestory train tiny.toml -m train.rate=1e-3,5e-4,2e-4 run.seed=range(1,5) run.root=$work/$1"
}
finished() { find "$1" -name DONE ! -path '*/sweep-*' 2>/dev/null; }
done_runs() { finished "$1" | wc -l; }
wait_for_runs() { # folder, how many
  local tries
  for ((tries = 0; tries < 1200; tries++)); do
    [ "$(done_runs "$1")" -lt "$2" ] || return 0
    sleep 0.1
  done
  fail "$1: $(done_runs "$1") runs in two minutes"
}
# The table over a sweep without its times, in full digits.
table_of() {
  python3 - "$1"/train/sweep-*/validation.table.json <<'PY'
import json, sys
table = json.load(open(sys.argv[1]))
kept = [i for i, column in enumerate(table["columns"]) if column["unit"] != "hours"]
print(json.dumps([[column["name"] for column in table["columns"]]] + [[row[i] for i in kept] for row in table["rows"]]))
PY
}
compare() { # folder, who made it
  [ -f "$1"/train/sweep-*/DONE ] || fail "$2: the sweep is not done"
  [ "$(done_runs "$1")" = 12 ] || fail "$2: $(done_runs "$1") runs"
  [ "$(table_of "$1")" = "$(table_of one)" ] || fail "$2: another table than that of one process"
  echo "$2: the table of one process"
}
ends() { # folder: what each finished run says of its end
  finished "$1" | xargs sha256sum | sort
}

prepare() {
  local split
  for split in train val; do
    "$root/build/clerestory" generate --out "$split" --rooms 1 --views 2 --size 32x32 --spp 2 --box-rooms --no-light \
      --split $split --seed ${#split} -q
  done
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
steps = 200
[log]
checkpoint_every = 5
TOML
  $(sweep one) -q >one.txt
  [ "$(done_runs one)" = 12 ] || fail "one process: $(done_runs one) runs"
}

by_parallel() {
  local command=(bash "$root/experiments/cluster/parallel.sh" --jobs 2 -- $(sweep par)) before
  POCL_MAX_PTHREAD_COUNT=1 setsid "${command[@]}" >par.txt 2>&1 &
  wait_for_runs par 3
  pkill -KILL --session $! # its jobs have process groups of their own
  wait $! 2>/dev/null || true
  ends par >par.before
  echo "parallel: killed after $(done_runs par) of 12 runs"
  [ "$(done_runs par)" -lt 12 ] || fail "parallel was done before it was killed"
  POCL_MAX_PTHREAD_COUNT=1 "${command[@]}" >par.txt 2>&1 || { cat par.txt; fail "parallel, gone on"; }
  [ -z "$(ends par | comm -13 - par.before)" ] || fail "parallel: finished runs were made again"
  compare par parallel
}

start_slurm() {
  local host
  host=$(hostname -s)
  mkdir state spool
  dd if=/dev/urandom of=munge.key bs=1024 count=1 2>/dev/null
  chmod 700 . && chmod 400 munge.key
  export SLURM_CONF=$work/slurm.conf
  cat >slurm.conf <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$((20000 + $$ % 10000))
SlurmdPort=$((30000 + $$ % 10000))
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SchedulerParameters=batch_sched_delay=0
KillWait=5
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
  munged --foreground --force --key-file="$work/munge.key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
    --log-file="$work/munged.log" --seed-file="$work/munged.seed" &
  daemons+=($!)
  slurmctld -D &
  daemons+=($!)
  slurmd -D &
  daemons+=($!)
  local tries
  for ((tries = 0; tries < 300; tries++)); do
    [ "$(sinfo -h -o %t 2>/dev/null)" != idle ] || return 0
    sleep 0.1
  done
  tail -n 5 munged.log slurmctld.log slurmd.log >&2
  fail "Slurm did not start"
}
queue_empty() { [ -z "$(squeue -h)" ]; }
wait_for_queue() {
  local tries
  for ((tries = 0; tries < 1800; tries++)); do
    ! queue_empty || return 0
    sleep 0.1
  done
  squeue >&2
  fail "jobs are still queued after three minutes"
}

by_slurm() {
  local command=(bash "$root/experiments/cluster/slurm.sh" -- $(sweep slurm)) task late tries
  start_slurm 2>daemons.txt
  "${command[@]}"
  wait_for_runs slurm 3
  # A task is told that its time is over: a checkpoint, and it is queued again.
  until grep -l 'interrupted after step' jobs/*/*.txt >/dev/null 2>&1; do
    [ "$(done_runs slurm)" -lt 10 ] || fail "slurm: no task wrote a checkpoint when its time was over"
    task=$(squeue -h -t R -o %i | head -n 1)
    timeout 1 scancel --batch --signal=USR1 "${task:-1_1}" 2>/dev/null || true # not while it is only starting
    sleep 0.3
  done
  late=$(basename "$(grep -l 'interrupted after step' jobs/*/*.txt | head -n 1)" .txt)
  for ((tries = 0; tries < 100; tries++)); do
    ! squeue -h -r -t PD -o %K | grep -qx "$late" || break
    sleep 0.1
  done
  [ $tries -lt 100 ] || { squeue >&2; fail "slurm: task $late was not queued again"; }
  # Another one's program is killed outright, and then the whole job.
  wait_for_runs slurm 5
  kill -KILL "$(pgrep -f "^$root/build/clerestory train .* run.root=$work/slurm " | tail -n 1)"
  wait_for_runs slurm 6
  scancel "${task%_*}"
  wait_for_queue
  echo "slurm: cancelled after $(done_runs slurm) of 12 runs"
  [ "$(done_runs slurm)" -lt 12 ] || fail "slurm was done before it was cancelled"
  ends slurm >slurm.before
  "${command[@]}"
  wait_for_queue
  [ "$(done_runs slurm)" = 12 ] || { tail jobs/*/*.txt; fail "slurm: $(done_runs slurm) of 12 runs"; }
  [ -z "$(ends slurm | comm -13 - slurm.before)" ] || fail "slurm: finished runs were made again"
  $(sweep slurm) -q >slurm.txt
  compare slurm slurm
}

prepare
[ $# -gt 0 ] || set -- parallel slurm
for who in "$@"; do "by_$who"; done
