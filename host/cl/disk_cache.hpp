// What is worth keeping between runs: built programs, the verdicts of the probe, measurements.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace clerestory {

/// Small files, each under the hash of its key: "<kind>-<hash>.bin". An entry holds its key and a checksum; one that is
/// damaged, cut short, no file or belongs to another key is as good as absent, and made again by the next store. A
/// cache that cannot be written stays empty.
class DiskCache {
 public:
  /// `folder` empty: $XDG_CACHE_HOME/clerestory, else ~/.cache/clerestory, else nothing is kept.
  explicit DiskCache(std::filesystem::path folder = {});

  std::optional<std::string> load(std::string_view kind, std::string_view key) const;
  void store(std::string_view kind, std::string_view key, std::string_view content) const;
  /// Where an entry lies; empty when nothing is kept.
  std::filesystem::path path(std::string_view kind, std::string_view key) const;

 private:
  std::filesystem::path folder_;
};

/// FNV-1a, 64 bits.
std::uint64_t hash_text(std::string_view text, std::uint64_t seed = 14695981039346656037ull);

}  // namespace clerestory
