#include "tests/experiments/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

namespace clerestory {

Program::Program(const std::vector<std::string>& arguments, const std::filesystem::path& output,
                 const Surroundings& around) {
  std::vector<std::string> words{around.program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  for (std::string& w : words) raw.push_back(w.data());
  raw.push_back(nullptr);
  pid_ = fork();
  if (pid_ != 0) return;
  const int file = open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(file, 1), dup2(file, 2);
  if (!around.results.empty()) dup2(open(around.results.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), 1);
  if (!around.folder.empty() && chdir(around.folder.c_str()) != 0) _exit(126);
  for (const auto& [name, value] : around.environment) setenv(name.c_str(), value.c_str(), 1);
  execv(raw[0], raw.data());
  _exit(127);
}

Program::~Program() {
  if (pid_ <= 0) return;
  signal(SIGKILL);
  wait();
}

void Program::signal(int number) const { kill(pid_, number); }

int Program::wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

Surroundings with_changed_kernel(const std::filesystem::path& folder, const std::string& file, const std::string& right,
                                 const std::string& wrong) {
  namespace fs = std::filesystem;
  fs::remove_all(folder);
  fs::copy(fs::path(CLERESTORY_SOURCE_DIR) / "kernels", folder, fs::copy_options::recursive);
  std::string source = text_of(folder / file);
  const std::size_t at = source.find(right);
  EXPECT_NE(at, std::string::npos) << file << " has no " << right;
  if (at != std::string::npos) std::ofstream(folder / file) << source.replace(at, right.size(), wrong);
  return {{}, {{"CLERESTORY_KERNELS", folder.string()}}};
}

bool wait_until(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(5);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(300));
  }
  return true;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<std::string> files_below(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  // Files come and go below a running program.
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code gone;
    if (entry->is_regular_file(gone)) names.push_back(entry->path().lexically_relative(folder).string());
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace clerestory
