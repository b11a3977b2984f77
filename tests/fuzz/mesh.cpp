// glTF, as text, binary, or packed by Draco.
#include "host/io/mesh_file.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("mesh", "mesh.glb", [](const std::filesystem::path& file) { read_mesh(file); });

}  // namespace clerestory
