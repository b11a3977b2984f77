// What is fuzzed: a reader of files that others may have made. tests/fuzz/<name>.cpp holds one each, and
// tests/fuzz/corpus/<name>/ the inputs that it begins with: `good*` are read, `bad*` are refused, others (what a fuzzer
// found) may be either.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace clerestory {

class FuzzTarget {
 public:
  /// Known to fuzz_targets() from here on. `file` is the name that an input is read under.
  FuzzTarget(std::string name, std::string file, std::function<void(const std::filesystem::path&)> read);

  const std::string& name() const { return name_; }
  /// Whether the input was read; "no" means an Error of the user that names the file, one beside it, or
  /// another that the input names by its whole path. Throws
  /// std::logic_error when it was refused in another way, and lets through whatever else is thrown.
  bool reads(std::string_view input) const;

 private:
  std::string name_, file_;
  std::function<void(const std::filesystem::path&)> read_;
};

/// Those that are linked into this program.
std::vector<FuzzTarget>& fuzz_targets();

}  // namespace clerestory
