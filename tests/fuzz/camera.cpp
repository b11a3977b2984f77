// A camera, read again from what is written of it.
#include "host/io/camera_file.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("camera", "camera.json", [](const std::filesystem::path& file) {
  const CameraFile read = read_camera(file);
  write_camera(file, read.camera, read.exposure);
  read_camera(file);
});

}  // namespace clerestory
