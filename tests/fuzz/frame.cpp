// A photograph with measured depth, and given maps.
#include "host/io/datasets.hpp"
#include "tests/fuzz/folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr int width = 8, height = 6;

void make(const fs::path& folder) {
  write_png(folder / "rgb.png", Image(width, height, 3, 0.5f), Encoding::Linear);
  write_png(folder / "right.png", Image(width, height, 3, 0.5f), Encoding::Linear);
  write_exr(folder / "depth.exr", Image(width, height, 1, 2.0f));
  write_exr(folder / "albedo.exr", Image(width, height, 3, 0.5f));
  write_exr(folder / "material.exr", Image(width, height, 3, 0.5f));
  write_camera(folder / "camera.json", Camera::from_fov(width, height, 60));
}

const FuzzTarget target = folder_target("frame", make, [](const fs::path& folder) {
  read_rgbd(folder);
  read_gbuffer(folder);
});

}  // namespace
}  // namespace clerestory
