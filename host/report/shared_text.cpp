#include "host/report/shared_text.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace clerestory {
namespace {

constexpr std::string_view kEndsAPath = " \t\n,;)]}'\"<>";

constexpr std::string_view kBeforeAPath = " \t\n(=,;:'\"[<";

bool within_a_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("._-~/").find(c) != std::string_view::npos;
}

/// Whether an absolute path begins at `at`: not "and/or", not "answer / truth", not "https://".
bool path_begins(const std::string& text, std::size_t at) {
  if (text[at] != '/' || at + 1 == text.size()) return false;
  const bool stands_alone = at == 0 || kBeforeAPath.find(text[at - 1]) != std::string_view::npos;
  return stands_alone && within_a_word(text[at + 1]) && text[at + 1] != '/';
}

/// "c" of "/a/b/c" and of "/a/b/c/".
std::string last_name(std::string path) {
  while (path.size() > 1 && path.ends_with('/')) path.pop_back();
  return path.substr(path.rfind('/') + 1);
}

/// "--camera=/a/b" as the path behind its option; other words as they are.
std::pair<std::string, std::string> option_and_path(const std::string& word) {
  const std::size_t equals = word.find("=/");
  return equals == std::string::npos ? std::pair{std::string(), word}
                                     : std::pair{word.substr(0, equals + 1), word.substr(equals + 1)};
}

/// Absolute paths that `record` names, the longest first: one may begin with another.
std::vector<std::string> paths_of(const Provenance& record) {
  std::vector<std::string> paths;
  for (const std::string& word : record.command) paths.push_back(option_and_path(word).second);
  for (const FileRecord& file : record.inputs) paths.push_back(file.path);
  std::erase_if(paths, [](const std::string& path) { return path.size() < 2 || path[0] != '/'; });
  std::ranges::sort(paths, std::ranges::greater(), &std::string::size);
  return paths;
}

/// A path with which a quoted text begins, also behind a "NAME=", ends with the quote: it may hold spaces.
std::size_t end_of_path(const std::string& text, std::size_t at) {
  const std::size_t quote = text.find_last_of("\"\n", at);
  const bool quoted = quote != std::string::npos && text[quote] == '"' && text.find_first_of(" ,;:/([", quote) == at;
  const std::size_t end = quoted ? text.find_first_of("\"\n", at) : text.find_first_of(kEndsAPath, at);
  return std::min(end, text.size());
}

/// Every absolute path up to what ends one, by its last name.
std::string with_last_names(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const bool path = path_begins(text, at);
    const std::size_t end = path ? end_of_path(text, at) : at + 1;
    const std::string part = text.substr(at, end - at);
    out += path ? last_name(part) : part;
    at = end;
  }
  return out;
}

std::string without_folder(const std::string& word) {
  const auto [option, path] = option_and_path(word);
  const bool one = path.starts_with('/') && path.find(",/") == std::string::npos;  // which may hold spaces
  return one ? option + last_name(path) : with_last_names(word);
}

}  // namespace

std::string without_folders(std::string text, const Provenance& record) {
  for (const std::string& path : paths_of(record))
    for (std::size_t at = 0; (at = text.find(path, at)) != std::string::npos;)
      if (path_begins(text, at))
        text.replace(at, path.size(), last_name(path));
      else
        ++at;
  return with_last_names(text);
}

Table without_folders(Table table, const Provenance& record) {
  table.note = without_folders(table.note, record);
  for (auto& row : table.rows)
    for (Cell& cell : row)
      if (auto* text = std::get_if<std::string>(&cell)) *text = without_folders(*text, record);
  return table;
}

std::string shared_command(const Provenance& record) {
  std::vector<std::string> words = record.command;
  std::ranges::transform(words, words.begin(), without_folder);
  return command_text(words);
}

}  // namespace clerestory
