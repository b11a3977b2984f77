// Kernel sources: found in the binary or in a folder, their includes put in.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "host/cl/device.hpp"
#include "host/cl/disk_cache.hpp"
#include "host/cl/program.hpp"

namespace clerestory {

extern const std::pair<const char*, const char*> embedded_kernels[];
extern const int embedded_kernel_count;

namespace {

constexpr const char* folder_variable = "CLERESTORY_KERNELS";

/// Where sources come from: a folder when the environment names one, the binary otherwise.
class Sources {
 public:
  Sources() {
    const char* folder = std::getenv(folder_variable);
    if (folder == nullptr || *folder == '\0') return;
    if (!std::filesystem::is_directory(folder))
      throw usage_error("is not a folder", folder_variable, folder, "kernel sources");
    folder_ = folder;
  }

  /// How compiler messages name the file: in a folder by its path, so that an editor can jump there.
  std::string label(std::string_view file) const { return folder_ ? (*folder_ / file).string() : std::string(file); }

  std::string text(std::string_view file, const std::string& asked_by) const {
    if (folder_) {
      std::ifstream stream(*folder_ / file, std::ios::binary);
      if (stream) return std::string(std::istreambuf_iterator<char>(stream), {});
    } else {
      for (int i = 0; i < embedded_kernel_count; ++i)
        if (file == embedded_kernels[i].first) return embedded_kernels[i].second;
    }
    if (folder_)
      throw usage_error(fmt::format("no kernel source \"{}\" in {} ({})", file, folder_->string(), folder_variable),
                        asked_by);
    throw Error(ErrorKind::Failed, fmt::format("no kernel source \"{}\" in this program", file), asked_by);
  }

 private:
  std::optional<std::filesystem::path> folder_;
};

std::string_view skip_blanks(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of(" \t"), text.size()));
}

/// The rest of a preprocessor line after `# word`, or nothing when the line is another one.
std::optional<std::string_view> directive(std::string_view line, std::string_view word) {
  line = skip_blanks(line);
  if (!line.starts_with('#')) return {};
  line = skip_blanks(line.substr(1));
  if (!line.starts_with(word)) return {};
  return line.substr(word.size());
}

std::string guard_name(std::string_view file) {
  std::string name = "CLERESTORY_ONCE_";
  for (const char c : file) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

/// Puts includes in. `#pragma once` becomes a guard, because an include may stand inside an #ifdef: a header is left
/// out the second time only when its first copy is sure to be compiled.
class Flattener {
 public:
  std::string flatten(std::string_view file) {
    append(std::string(file), {}, false);
    return std::move(out_);
  }

 private:
  void append(const std::string& file, const std::string& asked_by, bool conditional) {
    if (open_.contains(file)) throw Error(ErrorKind::Failed, fmt::format("\"{}\" includes itself", file), asked_by);
    if (surely_in_.contains(file)) return;
    const std::string text = sources_.text(file, asked_by);
    const bool once = text.find("#pragma once") != std::string::npos;
    if (once && !conditional) surely_in_.insert(file);
    open_.insert(file);
    if (once) out_ += fmt::format("#ifndef {0}\n#define {0}\n", guard_name(file));
    append_lines(file, text, conditional);
    if (once) out_ += "#endif\n";
    open_.erase(file);
  }

  void append_lines(const std::string& file, std::string_view text, bool conditional) {
    mark(file, 1);
    int depth = 0;
    for (int number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      if (directive(line, "if")) ++depth;  // #if, #ifdef, #ifndef
      if (directive(line, "endif")) --depth;
      if (const auto rest = directive(line, "include")) {
        append(included(*rest, file, number), fmt::format("{}:{}", sources_.label(file), number),
               conditional || depth > 0);
        mark(file, number + 1);
      } else {
        if (!directive(line, "pragma once")) out_ += line;
        out_ += '\n';
      }
    }
  }

  std::string included(std::string_view rest, const std::string& file, int number) const {
    rest = skip_blanks(rest);
    const std::size_t close = rest.size() > 1 ? rest.find('"', 1) : std::string_view::npos;
    if (!rest.starts_with('"') || close == std::string_view::npos)
      throw Error(ErrorKind::Failed, "cannot read this include", fmt::format("{}:{}", sources_.label(file), number),
                  std::string(rest), "#include \"folder/file.clh\"");
    return std::string(rest.substr(1, close - 1));
  }

  void mark(const std::string& file, int line) { out_ += fmt::format("#line {} \"{}\"\n", line, sources_.label(file)); }

  Sources sources_;
  std::string out_;
  std::set<std::string> open_, surely_in_;
};

/// What compilers see of a source: comments and indents left out, a row of blanks as one, no empty lines.
std::string code_of(std::string_view text) {
  std::string code;
  const auto blank = [&](char c) {
    if (code.empty() || code.back() == '\n') return;
    if (code.back() == ' ') code.pop_back();
    code += c;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i).starts_with("//")) {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (text.substr(i).starts_with("/*")) {
      i = std::min(text.find("*/", i + 2), text.size() - 1) + 1;
      blank(' ');
    } else if (text[i] == '"') {
      const std::size_t end = std::min(text.find_first_of("\"\n", i + 1), text.size() - 1);
      code += text.substr(i, end - i + 1), i = end;
    } else if (text[i] == '\n' || std::isspace(static_cast<unsigned char>(text[i]))) {
      blank(text[i] == '\n' ? '\n' : ' ');
    } else {
      code += text[i];
    }
  }
  blank('\n');
  return code;
}

}  // namespace

std::string kernel_source(std::string_view file) { return Flattener().flatten(file); }

std::vector<std::string> kernel_files() {
  std::vector<std::string> files;
  for (int i = 0; i < embedded_kernel_count; ++i) files.emplace_back(embedded_kernels[i].first);
  return files;  // the generated table is sorted
}

std::string kernels_hash() {
  const Sources sources;
  std::uint64_t hash = hash_text({});
  // Lengths keep "ab" + "c" and "a" + "bc" apart.
  const auto add = [&](const std::string& text) { hash = hash_text(fmt::format("{} {}", text.size(), text), hash); };
  for (const std::string& file : kernel_files()) add(file), add(code_of(sources.text(file, "kernels_hash")));
  return fmt::format("{:016x}", hash);
}

std::string kernel_hash(std::string_view file) { return code_hash(kernel_source(file)); }

std::string code_hash(const std::string& source) {
  std::string code;
  std::istringstream lines(source);
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("#line ")) code += line + "\n";  // names of folders, and lines that a comment moves
  return fmt::format("{:016x}", hash_text(code_of(code)));
}

}  // namespace clerestory
