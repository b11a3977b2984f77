#!/usr/bin/env bash
# A sweep over several processes or machines by GNU parallel: a job for each of its runs, then the table over all.
# Given again, the same command goes on: runs that failed or were killed are tried again, finished ones are skipped.
#   usage: bash experiments/cluster/parallel.sh [OPTION OF parallel]... -- clerestory run|train CONFIG [KEY=VALUE...] -m
#   such as --jobs 2, or --sshlogin node1,node2 --workdir . --env POCL_MAX_PTHREAD_COUNT
# Machines share the folder, by a file system that knows flock (NFS does). Several jobs on one machine share its cores:
# POCL_MAX_PTHREAD_COUNT=N gives each N of them. What each job said, and how it ended, lies in jobs/<sum>/.
set -euo pipefail
options=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  options+=("$1")
  shift
done
[ $# -gt 1 ] || { sed -n '2,5s/^# //p' "$0" >&2; exit 2; }
shift
commands=$("$@" --list)
folder=jobs/$(cksum <<<"$commands" | cut -d ' ' -f 1)
mkdir -p "$folder"
printf '%s\n' "$commands" >"$folder/commands"
parallel --joblog "$folder/joblog" --resume-failed --results "$folder/said/" "${options[@]}" <"$folder/commands" >/dev/null ||
  { echo "some runs are not done ($folder/joblog); the same command tries them again" >&2; exit 1; }
exec "$@"
