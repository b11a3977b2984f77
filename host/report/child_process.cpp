// posix_spawn, with files for what goes in and out: nobody waits for the other, however much either writes.
#include "host/report/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <thread>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/temporary_folder.hpp"

extern char** environ;

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPoll(100);

pid_t spawn(const std::vector<std::string>& arguments, const std::string& in, const std::string& out,
            const std::string& errors) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, in.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT, 0600);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0)
    throw Error(ErrorKind::Failed, std::string("cannot be started: ") + std::strerror(error), arguments[0]);
  return child;
}

/// Waits; what waitpid() says.
int end_of(pid_t child, const std::function<bool()>& goes_on) {
  int status = 0;
  for (pid_t ended = 0; ended != child;) {
    ended = ::waitpid(child, &status, goes_on ? WNOHANG : 0);
    if (ended < 0 && errno != EINTR)  // its end went to nobody: a parent of ours ignores SIGCHLD
      throw Error(ErrorKind::Failed, std::string("how it ended is not known: ") + std::strerror(errno),
                  "a child process");
    if (ended != 0) continue;
    if (!goes_on()) ::kill(child, SIGKILL);
    std::this_thread::sleep_for(kPoll);
  }
  return status;
}

}  // namespace

bool is_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/bin:/usr/bin");  // what posix_spawnp assumes
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::path(folder.empty() ? "." : folder) / name;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored) && ::access(file.c_str(), X_OK) == 0) return true;
  }
  return false;
}

ChildResult run_child(const std::vector<std::string>& arguments, const std::string& input,
                      const std::function<bool()>& goes_on) {
  const TemporaryFolder scratch;
  const std::string in = (scratch / "in").string(), out = (scratch / "out").string(),
                    errors = (scratch / "errors").string();
  write_file(in, input);
  const pid_t child = spawn(arguments, in, out, errors);
  const int status = end_of(child, goes_on);
  const auto written = [](const std::string& file) { return read_file(file, std::uint64_t{1} << 30, true); };
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), written(out), written(errors)};
}

}  // namespace clerestory
