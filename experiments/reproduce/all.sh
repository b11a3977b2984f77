#!/usr/bin/env bash
# Every result of docs/results, one after another, missing and stale ones first.
# usage: bash experiments/reproduce/all.sh [--list | --stale]
#   --list    name them, with minutes on two cores and whether there is a result, stale or not
#   --stale   only those that are missing, or were made with other weights, configs or kernels than are here now
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/result.sh"
case "${*:-}" in
  "" | --stale | --list) prepare ;;
  *) sed -n '3,5s/^# //p' "$script" >&2 && exit 2 ;;
esac
[ "${1:-}" != --list ] || exec build/clerestory results list
names=$(build/clerestory results list --names "$@")
for name in $names; do
  bash "experiments/reproduce/$name.sh"
done
