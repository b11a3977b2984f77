// fork, exec, three pipes and poll.
#include "host/report/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "host/error.hpp"

extern char** environ;

namespace clerestory {
namespace {

/// Both ends close on exec and on leaving the scope.
struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw Error(ErrorKind::Failed, std::string("no pipe: ") + std::strerror(errno));
    read = ends[0], write = ends[1];
  }
  ~Pipe() { close_read(), close_write(); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_read() { close_end(read); }
  void close_write() { close_end(write); }

 private:
  static void close_end(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }
};

/// A child that exits early must not kill us when we write to it.
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe() { before_ = std::signal(SIGPIPE, SIG_IGN); }
  ~IgnoreBrokenPipe() { std::signal(SIGPIPE, before_); }

 private:
  void (*before_)(int);
};

pid_t spawn(const std::vector<std::string>& arguments, const Pipe& in, const Pipe& out, const Pipe& errors) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.read, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.write, STDERR_FILENO);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0)
    throw Error(ErrorKind::Failed, std::string("cannot be started: ") + std::strerror(error), arguments[0]);
  return child;
}

/// Appends what is there; false at the end of the stream.
bool drain(int from, std::string& to) {
  std::array<char, 65536> block;
  const ssize_t got = ::read(from, block.data(), block.size());
  if (got > 0) to.append(block.data(), static_cast<std::size_t>(got));
  return got > 0 || (got < 0 && errno == EINTR);
}

}  // namespace

bool is_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/bin:/usr/bin");  // what posix_spawnp assumes
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path file = std::filesystem::path(folder.empty() ? "." : folder) / name;
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored) && ::access(file.c_str(), X_OK) == 0) return true;
  }
  return false;
}

ChildResult run_child(const std::vector<std::string>& arguments, const std::string& input) {
  const IgnoreBrokenPipe ignore;
  Pipe in, out, errors;
  const pid_t child = spawn(arguments, in, out, errors);
  in.close_read(), out.close_write(), errors.close_write();
  ::fcntl(in.write, F_SETFL, O_NONBLOCK);

  // Feed and listen at once: either side may fill its pipe before the other is done.
  ChildResult result;
  std::size_t sent = 0;
  if (input.empty()) in.close_write();
  while (in.write >= 0 || out.read >= 0 || errors.read >= 0) {
    std::array<pollfd, 3> ends{{{in.write, POLLOUT, 0}, {out.read, POLLIN, 0}, {errors.read, POLLIN, 0}}};
    if (::poll(ends.data(), ends.size(), -1) < 0 && errno != EINTR) break;
    if (ends[0].revents) {
      const ssize_t got = ::write(in.write, input.data() + sent, input.size() - sent);
      if (got > 0) sent += static_cast<std::size_t>(got);
      if (sent == input.size() || (got < 0 && errno != EAGAIN && errno != EINTR)) in.close_write();
    }
    if (ends[1].revents && !drain(out.read, result.out)) out.close_read();
    if (ends[2].revents && !drain(errors.read, result.errors)) errors.close_read();
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace clerestory
