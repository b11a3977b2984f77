#!/usr/bin/env bash
# A sweep over the machines of a Slurm cluster: an array job with a task for each of its runs. Submitted again, it goes
# on: finished runs are skipped. Afterwards the command itself prints the table over all.
#   usage: bash experiments/cluster/slurm.sh [OPTION OF sbatch]... -- clerestory run|train CONFIG [KEY=VALUE...] -m
#   such as --cpus-per-task 8 --time 4:00:00, or --array 1-100%4 for four at a time
# A minute before its time is over a task writes a checkpoint and is queued again. Machines share the folder, by a file
# system that knows flock (NFS does). What each task said lies in jobs/<sum>/.
set -euo pipefail

run_task() { # file of commands: the line of this task
  local line child code=0 late=
  line=$(sed -n "${SLURM_ARRAY_TASK_ID}p" "$1")
  [ -n "$line" ] || { echo "$1 has no line $SLURM_ARRAY_TASK_ID" >&2; exit 2; }
  export POCL_MAX_PTHREAD_COUNT=${SLURM_CPUS_PER_TASK:-1}
  bash -c "exec $line" &
  child=$!
  trap 'late=1; kill -TERM $child' USR1
  trap 'kill -TERM $child' TERM
  while code=0; wait "$child" || code=$?; [ "$code" -gt 128 ] && kill -0 "$child" 2>/dev/null; do :; done
  if [ -n "$late" ] && { [ "$code" = 4 ] || [ "$code" = 143 ]; }; then # 143: before it listened
    exec scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
  fi
  exit "$code"
}

if [ "${1-}" = --task ]; then run_task "$2"; fi
options=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  options+=("$1")
  shift
done
[ $# -gt 1 ] || { sed -n '2,5s/^# //p' "$0" >&2; exit 2; }
shift
commands=$("$@" --list)
folder=$PWD/jobs/$(cksum <<<"$commands" | cut -d ' ' -f 1)
mkdir -p "$folder"
printf '%s\n' "$commands" >"$folder/commands"
sbatch --job-name clerestory --array "1-$(wc -l <"$folder/commands")" --requeue --signal B:USR1@60 --open-mode append \
  --output "$folder/%a.txt" "${options[@]}" "${BASH_SOURCE[0]}" --task "$folder/commands"
