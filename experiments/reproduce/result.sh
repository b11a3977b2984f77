# Sourced by the scripts of results. Not to be run by itself.
#   result CONFIG [KEY=VALUE...] [-- OPTION...]
# runs the study of that config and leaves docs/results/NAME.{json,md,svg}, where NAME is the script's own name; options
# go to `clerestory results write` (--plot COLUMN, --table NAME). Interrupted, the same script goes on where it was.
source "$(dirname "${BASH_SOURCE[0]}")/../setup.sh"
script=$(realpath -- "$0")
cd "$root"

# The program, up to date; what its building says goes to stderr.
prepare() {
  install_packages >&2
  build clerestory >&2
}

result() {
  local name run words=() title folder
  name=$(basename "$script" .sh)
  while [ $# -gt 0 ] && [ "$1" != -- ]; do words+=("$1") && shift; done
  [ $# -eq 0 ] || shift
  prepare
  title=$(sed -n '2,/^# minutes:/{/^# minutes:/!s/^# //p}' "$script" | paste -sd' ')
  folder=$(build/clerestory results folder)
  run=$(build/clerestory run "${words[@]}" run.root="$folder" | tee /dev/stderr | tail -n 1)
  build/clerestory results write "$run" --name "$name" --title "${title%.}" "$@"
}
