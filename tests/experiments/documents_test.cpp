// README and docs: links that lead somewhere, and commands that the program knows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "host/io/files.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kSource = CLERESTORY_SOURCE_DIR;

/// What people read, relative to the tree.
std::vector<fs::path> documents() {
  std::vector<fs::path> found{"README.md", "CONTRIBUTING.md"};
  for (const auto& entry : fs::directory_iterator(kSource / "docs"))
    if (entry.is_regular_file()) found.push_back(entry.path().lexically_relative(kSource));
  return found;
}

std::vector<std::string> matches(const std::string& text, const std::regex& expression) {
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it) found.push_back((*it)[1]);
  return found;
}

/// GitHub's name of a heading.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading)
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-')
      anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (c == ' ')
      anchor += '-';
  return anchor;
}

TEST(Documents, LinksLeadSomewhere) {
  int links = 0;
  for (const fs::path& document : documents())
    for (const std::string& target :
         matches(read_file(kSource / document), std::regex("\\]\\(([^)#]*(?:#[^)]*)?)\\)"))) {
      const std::size_t hash = target.find('#');
      const fs::path file =
          hash == 0 ? kSource / document : (kSource / document).parent_path() / target.substr(0, hash);
      EXPECT_TRUE(fs::exists(file)) << document << ": " << target;
      ++links;
      if (hash == std::string::npos || !fs::exists(file)) continue;
      std::set<std::string> anchors;
      for (const std::string& heading : matches(read_file(file), std::regex("\n#+ ([^\n]*)")))
        anchors.insert(anchor_of(heading));
      EXPECT_TRUE(anchors.contains(target.substr(hash + 1))) << document << ": " << target;
    }
  EXPECT_GT(links, 10);
}

TEST(Documents, TheReadmeLeadsToAllOfThem) {
  const std::string readme = read_file(kSource / "README.md");
  int linked = 0;
  for (const fs::path& document : documents()) {
    if (document.extension() != ".md" || document == "README.md") continue;
    EXPECT_THAT(readme, HasSubstr(fmt::format("]({})", document.string())));
    ++linked;
  }
  EXPECT_GE(linked, 5);
}

/// A command of a document: "insert" or "data check", and the options that it is given.
struct Command {
  fs::path document;
  std::string name;
  std::vector<std::string> options;
};

std::vector<Command> commands_of(const fs::path& document) {
  std::vector<Command> found;
  std::istringstream lines(std::regex_replace(read_file(kSource / document), std::regex("\\\\-"), "-"));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("clerestory ")) continue;
    line = line.substr(0, line.find(" # "));
    std::istringstream words(line);
    Command command{document, "", matches(line, std::regex("(--[a-z-]+)"))};
    words >> command.name >> command.name;
    if (std::string second;
        (command.name == "data" || command.name == "weights" || command.name == "results") && words >> second)
      command.name.append(" ").append(second);
    found.push_back(command);
  }
  return found;
}

TEST(Documents, CommandsAndTheirOptionsExist) {
  const ScratchFolder folder("clerestory-documents");
  std::map<std::string, std::string> helps;
  int options = 0;
  for (const fs::path& document : documents())
    for (const Command& command : commands_of(document)) {
      std::string& help = helps[command.name];
      if (help.empty()) {
        std::istringstream in(command.name);
        std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
        words.push_back("--help");
        ASSERT_EQ(Program(words, folder / "help.txt").wait(), 0) << document << ": " << command.name;
        help = text_of(folder / "help.txt");
      }
      for (const std::string& option : command.options) {
        EXPECT_TRUE(std::regex_search(help, std::regex(fmt::format("[ ,]{}[ ,=\n]", option))))
            << document << ": clerestory " << command.name << " " << option;
        ++options;
      }
    }
  EXPECT_GT(options, 40);
}

}  // namespace
}  // namespace clerestory
