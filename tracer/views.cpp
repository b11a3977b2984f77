#include "tracer/views.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <numbers>
#include <set>

namespace clerestory {
namespace {

constexpr double kGoodEnough = 1.0;
constexpr std::uint64_t kRollStream = 1, kFramingStream = 2;  // leave a view's other numbers as they are

double degrees_wide(Random& random) {
  const float kind = random.unit();  // most cameras lie between a phone's 50 and a wide lens's 85 degrees
  if (kind < 0.2f) return static_cast<double>(random.between(35, 50));
  if (kind < 0.75f) return static_cast<double>(random.between(50, 85));
  return static_cast<double>(random.between(85, 120));
}

bool is_inside(const std::vector<Occupied>& occupied, const glm::vec3& eye) {
  constexpr float margin = 0.2f;
  return std::any_of(occupied.begin(), occupied.end(), [&](const Occupied& o) {
    return eye.x > o.x0 - margin && eye.x < o.x1 + margin && eye.z > o.z0 - margin && eye.z < o.z1 + margin &&
           o.height > eye.y - 0.35f;
  });
}

Camera candidate(const Room& room, int width, int height, Random& random) {
  Camera camera = Camera::from_fov(width, height, degrees_wide(random));
  const float x = room.size.x / 2 - 0.25f, z = room.size.z / 2 - 0.25f;
  glm::vec3 eye(0), target(0);
  for (int attempt = 0; attempt < 30; ++attempt) {
    eye = {random.between(-x, x), random.between(0.9f, 1.8f), random.between(-z, z)};
    // Photographers step back: towards a wall or a corner.
    if (random.chance(0.7f)) eye.x = std::copysign(x * random.between(0.75f, 1.f), eye.x);
    if (random.chance(0.7f)) eye.z = std::copysign(z * random.between(0.75f, 1.f), eye.z);
    eye.y = std::min(eye.y, room.size.y - 0.3f);
    if (!is_inside(room.occupied, eye)) break;
  }
  for (int attempt = 0; attempt < 10; ++attempt) {
    target = {random.between(-0.8f, 0.8f) * x, random.between(0.4f, 1.4f), random.between(-0.8f, 0.8f) * z};
    if (std::hypot(target.x - eye.x, target.z - eye.z) > 0.45f * std::min(room.size.x, room.size.z)) break;
  }
  look_at(camera, Vec3(eye), Vec3(target + glm::vec3(1e-3f, 0, 0)));
  return camera;
}

/// From above at a piece of furniture, from where there is none. Without furniture, or where no eye is found near it, a
/// candidate across the room.
Camera close_up(const Room& room, int width, int height, Random& random) {
  constexpr float kLeastHeight = 0.3f;
  std::vector<Occupied> things = room.occupied;
  std::erase_if(things, [](const Occupied& o) { return o.height < kLeastHeight; });
  if (things.empty()) return candidate(room, width, height, random);
  Camera camera = Camera::from_fov(width, height, static_cast<double>(random.between(35, 70)));
  const Occupied& thing = random.one_of(things);
  const glm::vec3 target{random.between(thing.x0, thing.x1), std::min(thing.height, 1.4f) * random.between(0.6f, 1.1f),
                         random.between(thing.z0, thing.z1)};
  const float x = room.size.x / 2 - 0.2f, z = room.size.z / 2 - 0.2f;
  for (int attempt = 0; attempt < 30; ++attempt) {
    const float distance = random.between(0.6f, 1.6f), turn = random.between(0, glm::two_pi<float>());
    const float above = glm::radians(random.between(5, 50)), along = distance * std::cos(above);
    const glm::vec3 eye =
        target + glm::vec3(along * std::cos(turn), distance * std::sin(above), along * std::sin(turn));
    const bool in_the_room = std::abs(eye.x) < x && std::abs(eye.z) < z && eye.y > 0.5f && eye.y < room.size.y - 0.3f;
    if (!in_the_room || is_inside(room.occupied, eye)) continue;
    look_at(camera, Vec3(eye), Vec3(target + glm::vec3(1e-3f, 0, 0)));
    return camera;
  }
  return candidate(room, width, height, random);
}

/// Down at what stands or lies up to 3 m away, by somebody who stands.
Camera from_above(const Room& room, int width, int height, Random& random) {
  Camera camera = Camera::from_fov(width, height, static_cast<double>(random.between(40, 80)));
  const float x = room.size.x / 2 - 0.25f, z = room.size.z / 2 - 0.25f;
  for (int attempt = 0; attempt < 30; ++attempt) {
    const glm::vec3 eye{random.between(-x, x), std::min(random.between(1.4f, 2.2f), room.size.y - 0.3f),
                        random.between(-z, z)};
    const float along = random.between(1, 3), turn = random.between(0, glm::two_pi<float>());
    const glm::vec3 target{eye.x + along * std::cos(turn), random.between(0, 0.8f), eye.z + along * std::sin(turn)};
    if (std::abs(target.x) > x || std::abs(target.z) > z || is_inside(room.occupied, eye)) continue;
    look_at(camera, Vec3(eye), Vec3(target + glm::vec3(1e-3f, 0, 0)));
    return camera;
  }
  return candidate(room, width, height, random);
}

/// Turned about its own axis: half of all views by less than a quarter of `most` degrees.
void roll(Camera& camera, double most, Random random) {
  const double part = static_cast<double>(random.between(-1, 1));
  const double angle = most * part * std::abs(part) * std::numbers::pi / 180;
  const double c = std::cos(angle), s = std::sin(angle);
  for (std::size_t row = 0; row < 3; ++row) {
    const double right = camera.camera_to_world[4 * row], up = camera.camera_to_world[4 * row + 1];
    camera.camera_to_world[4 * row] = c * right + s * up, camera.camera_to_world[4 * row + 1] = c * up - s * right;
  }
}

/// What is tried for one view, in order.
class Candidates {
 public:
  /// View v is the same however many are asked for.
  Candidates(const Room& room, int v, int width, int height, const Random& random, const Handling& handling)
      : room_(room),
        width_(width),
        height_(height),
        roll_(handling.roll),
        own_(random.fork(static_cast<std::uint64_t>(v))) {
    const double kind = static_cast<double>(own_.fork(kFramingStream).unit());
    if (kind < handling.close_ups)
      framing_ = Framing::CloseUp;
    else if (kind < handling.close_ups + handling.from_above)
      framing_ = Framing::FromAbove;
  }

  Camera next() {
    Camera camera = framed();
    if (roll_ > 0) roll(camera, roll_, own_.fork(kRollStream));
    return camera;
  }
  Framing framing() const { return framing_; }

 private:
  Camera framed() {
    if (framing_ == Framing::CloseUp) return close_up(room_, width_, height_, own_);
    if (framing_ == Framing::FromAbove) return from_above(room_, width_, height_, own_);
    return candidate(room_, width_, height_, own_);
  }

  const Room& room_;
  int width_, height_;
  double roll_;
  Random own_;
  Framing framing_ = Framing::Room;
};

}  // namespace

double judge_view(const TraceMaps& maps, Framing framing) {
  std::vector<float> depth;
  std::set<int> kinds;
  std::size_t emitting = 0;
  const std::size_t pixels = maps.depth.pixels();
  std::vector<int> direction(6, 0);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (maps.depth.data[i] <= 0) return -10;
    depth.push_back(maps.depth.data[i]);
    emitting += maps.emitter[i] >= 0;
    // Albedo in coarse steps counts materials well enough.
    kinds.insert(static_cast<int>(maps.albedo.data[i] * 8) + 10 * static_cast<int>(maps.albedo.data[pixels + i] * 8) +
                 100 * static_cast<int>(maps.albedo.data[2 * pixels + i] * 8) +
                 1000 * static_cast<int>(maps.roughness.data[i] * 5));
    int axis = 0;
    for (int c = 1; c < 3; ++c) {
      const std::size_t at = static_cast<std::size_t>(c) * pixels + i;
      if (std::abs(maps.normal.data[at]) > std::abs(maps.normal.data[static_cast<std::size_t>(axis) * pixels + i]))
        axis = c;
    }
    ++direction[static_cast<std::size_t>(2 * axis +
                                         (maps.normal.data[static_cast<std::size_t>(axis) * pixels + i] > 0))];
  }
  std::sort(depth.begin(), depth.end());
  const auto quantile = [&](double q) {
    return static_cast<double>(depth[static_cast<std::size_t>(q * static_cast<double>(pixels - 1))]);
  };
  const double glow = static_cast<double>(emitting) / static_cast<double>(pixels);
  const double same =
      static_cast<double>(*std::max_element(direction.begin(), direction.end())) / static_cast<double>(pixels);
  double score = 0;
  const double distance = framing == Framing::CloseUp ? 0.4 : framing == Framing::FromAbove ? 0.7 : 1;
  if (quantile(0.02) < 0.35 * distance) score -= 2;
  if (quantile(0.15) < 0.7 * distance) score -= 1;
  if (quantile(0.5) < 1.2 * distance) score -= 1;
  if (glow > 0.12) score -= 1;
  if (same > 0.75) score -= 1;
  score += std::min(1.0, 0.04 * static_cast<double>(kinds.size()));
  score += std::min(1.0, 0.35 * (quantile(0.95) / quantile(0.05) - 1));
  return score;
}

std::vector<Camera> choose_views(TraceScene& scene, const Room& room, int count, int width, int height, Random random,
                                 const Handling& handling, std::vector<int>* chosen) {
  std::vector<Camera> views;
  for (int v = 0; v < count; ++v) {
    Candidates candidates(room, v, width, height, random, handling);
    double best = -1e9;
    Camera camera;
    int taken = 0;
    for (int i = 0; i < kViewCandidates && best < kGoodEnough; ++i) {
      const Camera candidate = candidates.next();
      const double score =
          judge_view(scene.maps(candidate.resized(32, std::max(1, 32 * height / width))), candidates.framing());
      if (score > best) best = score, camera = candidate, taken = i;
    }
    views.push_back(camera);
    if (chosen != nullptr) chosen->push_back(taken);
  }
  return views;
}

std::vector<Camera> chosen_views(const Room& room, std::span<const int> chosen, int width, int height, Random random,
                                 const Handling& handling) {
  std::vector<Camera> views;
  for (std::size_t v = 0; v < chosen.size(); ++v) {
    Candidates candidates(room, static_cast<int>(v), width, height, random, handling);
    for (int i = 0; i < chosen[v]; ++i) candidates.next();
    views.push_back(candidates.next());
  }
  return views;
}

}  // namespace clerestory
