// Work in another process.
#pragma once
#include <sys/wait.h>
#include <unistd.h>

namespace clerestory {

/// Runs `work` in another process and gives its exit status.
template <class Work>
int in_child(const Work& work) {
  const pid_t child = fork();
  if (child == 0) _exit(work());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace clerestory
