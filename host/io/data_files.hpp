// Files that come with the program: weights, panoramas and models, configs, lists of rooms.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// Where `below` ("assets", "nets/weights") may lie, first choice first: in the folder that CLERESTORY_DATA names,
/// alone; else as an installed program has it (../share/clerestory), beside the program, or up to two folders above it,
/// as in a source tree with build/clerestory.
std::vector<std::filesystem::path> data_places(const std::filesystem::path& below);

/// `path` where it exists; else the first of its places that does; else `path`. For configs, lists of rooms,
/// frames, photographs and meshes, which users name as a source tree has them.
std::filesystem::path found_data(const std::filesystem::path& path);

/// "A, B", for messages.
std::string text_of(const std::vector<std::filesystem::path>& places);

}  // namespace clerestory
