// The one exception of the project. It says what went wrong, where, what was found and what was expected; the command
// line turns its kind into the exit code.
#pragma once
#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace clerestory {

/// Kinds map to exit codes: Failed 1, Usage 2 (arguments, config or input), Device 3, Interrupted 4 (can be resumed).
enum class ErrorKind { Failed = 1, Usage = 2, Device = 3, Interrupted = 4 };

class Error : public std::runtime_error {
 public:
  /// `where` is a file, a key or an argument; `found` and `expected` may be empty.
  /// The message reads "where: what (found X, expected Y)".
  Error(ErrorKind kind, const std::string& what, const std::string& where = {}, const std::string& found = {},
        const std::string& expected = {})
      : std::runtime_error(text(what, one_line(where), one_line(found), expected)),
        kind_(kind),
        where_(one_line(where)) {}

  ErrorKind kind() const { return kind_; }
  const std::string& where() const { return where_; }
  /// The message without `where`.
  std::string reason() const { return where_.empty() ? what() : std::string(what()).substr(where_.size() + 2); }
  int exit_code() const { return static_cast<int>(kind_); }

 private:
  /// A file's name may hold a line break, which would look like another message.
  static std::string one_line(std::string text) {
    for (std::size_t at = 0; (at = text.find_first_of("\n\r", at)) != std::string::npos; at += 2)
      text.replace(at, 1, text[at] == '\n' ? "\\n" : "\\r");
    return text;
  }
  static std::string text(const std::string& what, const std::string& where, const std::string& found,
                          const std::string& expected) {
    std::string message = where.empty() ? what : where + ": " + what;
    if (!found.empty() && !expected.empty()) return message + " (found " + found + ", expected " + expected + ")";
    if (!found.empty()) return message + " (found " + found + ")";
    if (!expected.empty()) return message + " (expected " + expected + ")";
    return message;
  }
  ErrorKind kind_;
  std::string where_;
};

/// Bad arguments, configuration or input files.
inline Error usage_error(const std::string& what, const std::string& where = {}, const std::string& found = {},
                         const std::string& expected = {}) {
  return Error(ErrorKind::Usage, what, where, found, expected);
}

}  // namespace clerestory
