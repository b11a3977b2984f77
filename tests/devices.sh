#!/usr/bin/env bash
# Gets every driver that can be had without its hardware and asks `clerestory check` of each: PoCL, Intel's runtime for
# CPUs with its widest and with narrower vectors, Oclgrind (memory, races, wrong calls), Mesa's rusticl; and PoCL once
# more as a device that has the least of everything. Nothing is installed where programs would find it but Oclgrind and
# libclc; drivers lie in FOLDER and are named by OCL_ICD_VENDORS.
# Results: FOLDER/DRIVER.json, and devices.md and devices.html of all of them.
#   usage: bash tests/devices.sh [--quick] [--report FILE.md] [FOLDER [DRIVER...]]
#   drivers: pocl pocl_less intel intel_avx2 oclgrind rusticl
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../experiments/setup.sh"
quick=() report=
while [ "${1-}" = --quick ] || [ "${1-}" = --report ]; do
  if [ "$1" = --quick ]; then quick=(--quick); shift; else report=$(realpath "$2"); shift 2; fi
done
folder=${1-$(mktemp -d)}
[ $# -eq 0 ] || shift
drivers=("$@")
[ ${#drivers[@]} -gt 0 ] || drivers=(pocl pocl_less intel intel_avx2 oclgrind rusticl)
packages+=(oclgrind libclc-15 python3-venv)
install_packages
mkdir -p "$folder"
folder=$(realpath "$folder")
cd "$root"
build clerestory

icd() { # NAME LIBRARY: a folder for OCL_ICD_VENDORS that has this driver alone
  mkdir -p "$folder/icd/$1"
  echo "$2" >"$folder/icd/$1/$1.icd"
}
get_intel() {
  [ -e "$folder/intel/lib/libintelocl.so" ] || {
    python3 -m venv "$folder/intel"
    "$folder/intel/bin/pip" install --quiet intel-opencl-rt intel-cmplr-lib-rt
  }
  icd "$1" "$folder/intel/lib/libintelocl.so"
}
get_mesa() { # unpacked, not installed: its .icd files would show it to every program
  mkdir -p "$folder/debs"
  [ -d "$folder/mesa" ] || (
    cd "$folder/debs"
    apt-get download -q mesa-opencl-icd libclang-cpp15 libllvm15 libllvmspirvlib15 libdrm-amdgpu1 libdrm-nouveau2 \
      libdrm-radeon1 libdrm2 libelf1 libexpat1 libsensors5 libzstd1 >/dev/null
    for package in *.deb; do dpkg -x "$package" "$folder/mesa"; done
  )
  icd rusticl "$folder/mesa/usr/lib/x86_64-linux-gnu/libRusticlOpenCL.so.1"
}

check() { # NAME [VARIABLE=VALUE...]: 1 says that kernels fail there; whether that is explained is asked at the end
  local name=$1 status=0
  shift
  rm -f "$folder/$name.json"
  env OCL_ICD_VENDORS="$folder/icd/$name" XDG_CACHE_HOME="$folder/cache" "$@" \
    build/clerestory check --device all --json="$folder/$name.json" "${quick[@]}" || status=$?
  [ "$status" -le 1 ] || exit "$status"
}
check_pocl() { icd pocl "$(cat /etc/OpenCL/vendors/pocl.icd)" && check pocl; }
check_pocl_less() {
  icd pocl_less "$(cat /etc/OpenCL/vendors/pocl.icd)"
  # MiB: a largest piece of 32 is the least that OpenCL allows.
  check pocl_less CLERESTORY_PRETEND=max_group=1,no_fp64,no_unified_memory,max_allocation=32,memory=64
}
# The vectoriser of 2024.2 to 2026.2 mixes up vectors of three where a function is not inlined, as GPUs' tracer shows,
# which CPUs do not get (checks/reproducers/intel_vectors_of_three.cl); with CL_CONFIG_CPU_VECTORIZER_MODE=1 it is right.
check_intel() { get_intel intel && check intel LD_LIBRARY_PATH="$folder/intel/lib"; }
check_intel_avx2() {
  get_intel intel_avx2
  check intel_avx2 LD_LIBRARY_PATH="$folder/intel/lib" CL_CONFIG_CPU_TARGET_ARCH=core-avx2
}
# A simulator, a thousand times slower: the smallest case of each kernel, with memory, races and calls looked at. What
# Debian's 21.10 needs: to stand in place of the loader, through which its clCreateCommandQueueWithProperties calls
# itself for ever; no optimisation, for it does not know llvm.experimental.noalias.scope.decl; a min(int16, int) that does
# not read beyond the int, where there are packets; and local memory for all kernels of a program together, since it adds
# them up.
check_oclgrind() {
  local quick=(--quick --again) # what it finds stands in its log, not in a verdict that was kept
  {
    echo '#ifdef PACKET'
    for ints in int4 int8 int16; do
      echo "$ints __attribute__((overloadable, const)) min($ints a, int b) { return min(a, ($ints)(b)); }"
    done
    echo '#endif'
  } >"$folder/oclgrind.clh"
  rm -f "$folder/oclgrind.log"
  check oclgrind LD_PRELOAD=/usr/lib/oclgrind/liboclgrind-rt.so OCLGRIND_DATA_RACES=1 OCLGRIND_CHECK_API=1 \
    OCLGRIND_LOCAL_MEM_SIZE=131072 OCLGRIND_BUILD_OPTIONS="-O0 -include $folder/oclgrind.clh" \
    OCLGRIND_LOG="$folder/oclgrind.log"
  [ ! -s "$folder/oclgrind.log" ] || { cat "$folder/oclgrind.log"; exit 1; }
}
check_rusticl() {
  get_mesa
  local lib=$folder/mesa/usr/lib/x86_64-linux-gnu
  check rusticl RUSTICL_ENABLE=llvmpipe LD_LIBRARY_PATH="$lib" GALLIUM_PIPE_SEARCH_DIR="$lib/gallium-pipe"
}

results=
for driver in "${drivers[@]}"; do
  "check_$driver"
  results+=${results:+,}$folder/$driver.json
done
said=$folder/said.txt
build/clerestory check --from "$results" --report "$folder/devices.html" >"$said" || true # 1 where one fails
build/clerestory check --from "$results" --report "${report:-$folder/devices.md}" >/dev/null || true
cat "$said"
grep -q ' unexplained 0$' "$said"
