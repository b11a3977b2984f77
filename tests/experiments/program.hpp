// The built `clerestory` as a child process, to be waited for, interrupted or killed.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace clerestory {

/// What a started program finds around it, where that is not what the test finds.
struct Surroundings {
  std::filesystem::path folder;                    // to work in
  std::map<std::string, std::string> environment;  // set besides the test's own
  std::filesystem::path program = CLERESTORY_PROGRAM;
  std::filesystem::path results = {};  // where stdout goes; empty: with stderr
};

/// A started program; what it says goes to a file.
class Program {
 public:
  Program(const std::vector<std::string>& arguments, const std::filesystem::path& output,
          const Surroundings& around = {});
  /// Kills what still runs: a test that gave up leaves no process behind.
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number) const;
  /// Exit code, or 128 + signal.
  int wait();

 private:
  pid_t pid_ = -1;
};

/// Around a program that reads its kernels from `folder`, where this copies them with the first `right` in `file` (such
/// as "nn/adam.cl") replaced by `wrong`.
Surroundings with_changed_kernel(const std::filesystem::path& folder, const std::string& file, const std::string& right,
                                 const std::string& wrong);

/// Asks every fraction of a millisecond, for five minutes at most; false when it never came true.
bool wait_until(const std::function<bool()>& condition);

std::string text_of(const std::filesystem::path& path);

/// Files below a folder, hidden ones too, by their name relative to it.
std::vector<std::string> files_below(const std::filesystem::path& folder);

}  // namespace clerestory
