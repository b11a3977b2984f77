// PoCL asks LLVM which CPU it runs on and compiles for that one. Loaded before it, this answers $OLDER_CPU in LLVM's place:
// "haswell" (AVX2 and FMA) or "nehalem" (SSE4), on a machine that has more. See older_cpu.sh.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// llvm::StringRef, and llvm::StringMap<bool> with its entries, as LLVM 15 lays them out.
struct text {
  const char *data;
  size_t size;
};
struct entry {
  size_t length;
  bool has;  // padded to 16 bytes, then the key
};
struct map {
  struct entry **table;
  unsigned buckets, items, tombstones, item_size;
};

static const char *cpu(void) {
  const char *named = getenv("OLDER_CPU");
  return named ? named : "haswell";
}

struct text _ZN4llvm3sys14getHostCPUNameEv(void) {
  struct text name = {cpu(), strlen(cpu())};
  return name;
}

static const char *key_of(const struct entry *e) { return (const char *)e + 2 * sizeof(size_t); }

static bool newer(const char *feature) {
  static const char *const than_haswell[] = {"avx512", "amx"}, *const than_nehalem[] = {"avx", "fma", "f16c"};
  for (size_t i = 0; i < 2; ++i)
    if (!strncmp(feature, than_haswell[i], strlen(than_haswell[i]))) return true;
  for (size_t i = 0; i < 3; ++i)
    if (!strcmp(cpu(), "nehalem") && !strncmp(feature, than_nehalem[i], strlen(than_nehalem[i]))) return true;
  return false;
}

bool _ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE(struct map *features) {
  const char *symbol = "_ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE";
  void *llvm = dlopen("libLLVM-15.so.1", RTLD_NOW | RTLD_NOLOAD);
  bool (*real)(struct map *) = llvm ? (bool (*)(struct map *))dlsym(llvm, symbol) : NULL;
  if (!real || !real(features)) return false;
  for (unsigned i = 0; i < features->buckets; ++i) {
    struct entry *e = features->table[i];
    const bool empty = !e || (uintptr_t)e > (uintptr_t)0x7fffffffffff;  // or a tombstone
    if (!empty && newer(key_of(e))) e->has = false;
  }
  return true;
}
