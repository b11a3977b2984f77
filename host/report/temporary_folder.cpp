#include "host/report/temporary_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "host/error.hpp"

namespace clerestory {

TemporaryFolder::TemporaryFolder() {
  std::string path = (std::filesystem::temp_directory_path() / "clerestory-XXXXXX").string();
  if (!::mkdtemp(path.data()))
    throw Error(ErrorKind::Failed, std::string("no temporary folder: ") + std::strerror(errno), path);
  path_ = path;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace clerestory
