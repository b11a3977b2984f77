// What all fuzz targets share, for libFuzzer and for the tests that replay the corpus.
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/fuzz/folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// A folder of this process, removed at its end.
struct Scratch {
  fs::path folder = fs::temp_directory_path() / fmt::format("clerestory_fuzz_{}", ::getpid());

  Scratch() { fs::create_directories(folder); }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
};

const fs::path& scratch_folder() {
  static const Scratch scratch;
  return scratch.folder;
}

fs::path put(const std::string& name, std::string_view bytes) {
  const fs::path file = scratch_folder() / name;
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

/// Ends the process as a crash does when this process computes for so many seconds; 0: no longer. What it waits for a
/// processor does not count.
void abort_after(int seconds) {
  std::signal(SIGPROF, [](int) { std::abort(); });
  itimerval timer{};
  timer.it_value.tv_sec = seconds;
  ::setitimer(ITIMER_PROF, &timer, nullptr);
}

}  // namespace

FuzzTarget::FuzzTarget(std::string name, std::string file, std::function<void(const fs::path&)> read)
    : name_(std::move(name)), file_(std::move(file)), read_(std::move(read)) {
  fuzz_targets().push_back(*this);
}

bool FuzzTarget::reads(std::string_view input) const {
  try {
    read_(put(file_, input));
    return true;
  } catch (const Error& error) {
    const std::string said = error.what();
    const bool names = said.find(scratch_folder().string()) != std::string::npos || said.starts_with('/');
    if (error.kind() != ErrorKind::Usage || !names) throw std::logic_error("refused, but not as a wrong file: " + said);
    return false;
  }
}

FuzzTarget folder_target(const std::string& name, const std::function<void(const fs::path&)>& make,
                         const std::function<void(const fs::path&)>& read) {
  return {name, name + ".input", [=, made = false](const fs::path& input) mutable {
            const fs::path right = scratch_folder() / (name + ".right"), folder = scratch_folder() / name;
            if (!made) {
              fs::create_directories(right);
              make(right);
              made = true;
            }
            const std::string text = read_file(input, 1 << 20, true);
            const std::size_t end = std::min(text.find('\n'), text.size());
            const fs::path changed = text.substr(0, end);
            std::error_code too_long;  // for the name of a file
            if (changed.is_absolute() || changed.lexically_normal() != changed ||
                !fs::is_regular_file(right / changed, too_long))
              throw usage_error("names no file of the folder", input.string());
            remove_tree(folder);
            fs::copy(right, folder, fs::copy_options::recursive);
            write_file(folder / changed, text.substr(std::min(end + 1, text.size())));
            read(folder);
          }};
}

std::vector<FuzzTarget>& fuzz_targets() {
  static std::vector<FuzzTarget> targets;
  return targets;
}

}  // namespace clerestory

/// libFuzzer's programs hold one target; an exception that leaves here is a crash.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  clerestory::abort_after(10);
  clerestory::fuzz_targets().front().reads({reinterpret_cast<const char*>(bytes), size});
  clerestory::abort_after(0);
  return 0;
}
