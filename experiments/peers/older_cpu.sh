#!/usr/bin/env bash
# Runs a command on PoCL (Debian 12's, with LLVM 15) as if this CPU had less: kernels as users' laptops compile them.
#   bash experiments/peers/older_cpu.sh haswell build/clerestory bench conv        haswell: AVX2 and FMA; nehalem: SSE4
# It has caches of its own, in build/older_cpu. A check that it works: `clerestory devices` names the CPU.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,4s/^# //p' "$0" >&2; exit 2; }
case $1 in haswell | nehalem) ;; *) echo "no such CPU here: $1 (haswell or nehalem)" >&2; exit 2 ;; esac
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$here/../../build/older_cpu
mkdir -p "$out/pocl-$1" "$out/cache-$1"
out=$(cd "$out" && pwd)
library=$out/older_cpu.so
[ "$library" -nt "$here/older_cpu.c" ] || cc -O1 -shared -fPIC -Wall -Wextra -o "$library" "$here/older_cpu.c" -ldl
cpu=$1 && shift
exec env OLDER_CPU="$cpu" LD_PRELOAD="$library" POCL_CACHE_DIR="$out/pocl-$cpu" XDG_CACHE_HOME="$out/cache-$cpu" "$@"
