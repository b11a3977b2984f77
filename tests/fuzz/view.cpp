// A view of a data set whose maps are all the same picture.
#include "host/io/datasets.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("view", "000_im.exr", [](const std::filesystem::path& file) {
  for (const char* map : {"mask", "albedo", "depth", "material", "normal", "emission"}) {
    const std::filesystem::path other = view_file(file.parent_path(), "000", map);
    std::filesystem::copy_file(file, other, std::filesystem::copy_options::overwrite_existing);
  }
  read_view(file.parent_path(), "000");
});

}  // namespace clerestory
