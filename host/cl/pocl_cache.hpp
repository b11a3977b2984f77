// PoCL's cache of built programs, which it cannot do without and does not check: where it lies, whether it can be
// used, and entries that a crash left incomplete. As of PoCL 3.1. Private to host/cl.
#pragma once
#include <filesystem>
#include <string>

namespace clerestory {

struct PoclCacheFolder {
  std::filesystem::path path;
  std::string variable;  // what names it: POCL_CACHE_DIR, XDG_CACHE_HOME or HOME; empty for PoCL's choice without these
};
PoclCacheFolder pocl_cache_folder();

/// "/cache, from POCL_CACHE_DIR", for messages.
std::string describe(const PoclCacheFolder& folder);

/// Makes the folder, as PoCL would. Why it cannot be used, naming folder and variable; empty when it can.
std::string pocl_cache_fault();

/// Removes the programs and kernels that are not whole, after a power cut or on a disk that was full; PoCL would end
/// the process on them, and builds again what is not there. Returns how many they were.
int drop_broken_pocl_entries();

}  // namespace clerestory
