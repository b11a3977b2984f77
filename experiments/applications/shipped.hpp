// Where the weights lie that come with the program.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// The folder that the environment variable names, alone; else `nets/weights` beside the program, above it (as in the
/// source tree, build/clerestory), and in the source tree that it was built from, wherever the program is now.
std::vector<std::filesystem::path> shipped_places(const char* variable);

/// For messages.
std::string text_of(const std::vector<std::filesystem::path>& places);

}  // namespace clerestory
