// PNG, JPEG, OpenEXR, HDR.
#include "host/io/image.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("picture", "picture.exr", [](const std::filesystem::path& file) {
  read_photo(file);
  read_map(file, 1);
});

}  // namespace clerestory
