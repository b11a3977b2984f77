#include "tracer/stereo.hpp"

#include <nlohmann/json.hpp>

#include "host/io/camera_file.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/panorama.hpp"

namespace clerestory {
namespace {

constexpr double kClearance = 0.1;  // metres beyond the second camera that are free

}  // namespace

std::optional<Camera> right_camera(TraceScene& scene, const Camera& left, double baseline) {
  Camera right = left;
  right.set_pose(left.rotation(), left.to_world({baseline, 0, 0}));
  const Vec3 along = left.direction_to_world({1, 0, 0});
  const TraceHit hit = scene.hits(planar(std::vector{left.position()}), planar(std::vector{along}), 0,
                                  static_cast<float>(baseline + kClearance))[0];
  return hit.triangle >= 0 ? std::nullopt : std::optional(right);
}

std::array<double, 16> relative_pose(const Camera& first, const Camera& second) {
  Camera relative;
  relative.set_pose(glm::transpose(first.rotation()) * second.rotation(), first.to_camera(second.position()));
  return relative.camera_to_world;
}

void write_stereo(const std::filesystem::path& room, const std::string& view, const Camera& left, const Camera& right,
                  double exposure) {
  write_camera(view_file(room, view, "right_camera", "json"), right, exposure);
  const nlohmann::ordered_json pair{{"baseline_m", glm::distance(left.position(), right.position())},
                                    {"right_to_left", relative_pose(left, right)}};
  write_file(view_file(room, view, "stereo", "json"), pair.dump(2) + "\n");
}

}  // namespace clerestory
