// Folders of which one file is somebody else's: what is shared by targets that read several files.
#pragma once
#include <filesystem>
#include <functional>

#include "tests/fuzz/target.hpp"

namespace clerestory {

/// A target whose input names a file in its first line and gives its content in what follows: `read` is given a folder
/// as `make` leaves it but for that file. Other names than those of the folder's files are refused.
FuzzTarget folder_target(const std::string& name, const std::function<void(const std::filesystem::path&)>& make,
                         const std::function<void(const std::filesystem::path&)>& read);

}  // namespace clerestory
