// Another program, run to its end.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace clerestory {

struct ChildResult {
  int status = 0;           // exit code, or 128 + signal
  std::string out, errors;  // what it wrote to stdout and stderr
};

/// Whether PATH holds a program of this name.
bool is_program(const std::string& name);

/// Starts `arguments[0]` from PATH without a shell, feeds it `input`, waits. Throws ErrorKind::Failed when it cannot be
/// started. `goes_on` is asked about ten times a second, no oftener however long all of it was stopped; its "no" ends
/// the child by SIGKILL.
ChildResult run_child(const std::vector<std::string>& arguments, const std::string& input,
                      const std::function<bool()>& goes_on = {});

}  // namespace clerestory
