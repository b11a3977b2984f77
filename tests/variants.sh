#!/usr/bin/env bash
# Writes checks/variants.txt: every kernel variant (kernel and defines) that the tests and commands launch here, and those
# in the list before that still have a kernel. `clerestory check` has to run each: after it ends, ask it. What no program
# launches any more goes when the list is emptied before.   usage: bash tests/variants.sh
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
install_packages
cd "$root"
build
list=checks/variants.txt
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export CLERESTORY_LAUNCHES=$work/launches
clerestory=build/clerestory

for suite in graph ops nets tracer experiments; do
  build/tests/test_$suite --gtest_brief=1 || { echo "test_$suite fails: nothing is listed" >&2; exit 1; }
done
$clerestory invert assets/real/office/rgb.png --camera assets/real/office/camera.json --out "$work/office" --spp 2 --quiet
$clerestory insert "$work/office" --at 330,400 --radius 0.2 --spp 2 --quiet
$clerestory edit "$work/office" --mask assets/real/office/floor.png --roughness 0.1 --spp 2 --quiet
$clerestory light "$work/office" --at 330,400 --quiet
for split in train val; do
  $clerestory generate --out "$work/$split" --rooms 1 --views 2 --spp 1 --seed 1 --split $split --size 64x48 --quiet
done
$clerestory train experiments/configs/mgnet_lite.toml "data.train=[$work/train]" "data.validation=[$work/val]" "run.root=$work/runs" train.steps=2 --quiet
$clerestory bench peak gemm conv mlp light --json="$work/bench.json" --quiet
$clerestory check --json="$work/check.json" --quiet || true # 1 where the list before is another

# What tests alone launch is left out.
{
  echo "# Kernels and defines that the program launches: bash tests/variants.sh"
  { grep -v '^#' "$list" || true; cat "$CLERESTORY_LAUNCHES"; } | grep -v -e '_probe\.cl:' -e PROBE_FAULT -e 'BVH_STACK=1 ' | sort -u |
    while IFS= read -r variant; do
      file=kernels/${variant%%:*} name=${variant#*:}
      if [ -f "$file" ] && grep -qE "\b${name%% *}\(" "$file"; then echo "$variant"; fi
    done
} >"$work/list"
mv "$work/list" "$list"
echo "$(grep -vc '^#' "$list") variants"
