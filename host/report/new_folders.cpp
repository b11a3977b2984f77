#include "host/report/new_folders.hpp"

#include "host/io/files.hpp"

namespace clerestory {
namespace fs = std::filesystem;

NewFolders::NewFolders(const fs::path& folder) {
  for (fs::path p = folder; !p.empty() && !fs::exists(p); p = p.parent_path()) made_.push_back(p);
  make_directories(folder);
}

NewFolders::~NewFolders() {
  std::error_code ignored;
  for (const fs::path& folder : made_) fs::remove(folder, ignored);  // refuses what is not empty
}

}  // namespace clerestory
