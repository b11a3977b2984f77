#include "nets/known_lamps.hpp"

#include <algorithm>
#include <cmath>

#include "host/math/statistics.hpp"
#include "nets/render_scene.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

constexpr double kBright = 3;  // times the ambient luminance
constexpr std::size_t kPatches = 8, kLamps = 20;
constexpr double kSmall = 0.02;  // of the scene's scale: patches of this radius are not split, of others the widest
constexpr double kWider = 1.44;  // a lobe's variance over that of what it covers: with it squares and discs cost least
constexpr double kPixelsOwn = 0.5;  // variance of a pixel over its area; rays meet cells of a depth map to half a cell
constexpr double kLeastFacing = 0.1;  // cosine: what a pixel that is seen edge-on shows of a surface

double luminance_of(const std::array<double, 3>& c) { return luminance(c[0], c[1], c[2]); }

/// A bright pixel: what it shows of a surface, and its radiance times that.
struct Spot {
  Vec3 place;
  double area = 0, power = 0;
};

struct Patch {
  std::vector<Spot> spots;
  double power = 0, own = 0;   // own: of its spots' own extents, times power
  Vec3 middle{0}, squares{0};  // squares of distances from the middle by axis, times power
  double spread() const { return squares.x + squares.y + squares.z; }
  double radius() const { return std::sqrt(spread() / power); }
};

Patch patch_of(std::vector<Spot> spots) {
  Patch patch;
  for (const Spot& s : spots) patch.power += s.power, patch.own += s.power * s.area, patch.middle += s.power * s.place;
  patch.middle /= patch.power;
  for (const Spot& s : spots) patch.squares += s.power * (s.place - patch.middle) * (s.place - patch.middle);
  patch.spots = std::move(spots);
  return patch;
}

/// In two, at its middle, across the axis along which it is widest.
std::pair<Patch, Patch> split(const Patch& patch) {
  const Vec3& q = patch.squares;
  const int axis = q.x >= q.y && q.x >= q.z ? 0 : q.y >= q.z ? 1 : 2;
  std::vector<Spot> low, high;
  for (const Spot& s : patch.spots) (s.place[axis] < patch.middle[axis] ? low : high).push_back(s);
  return {patch_of(std::move(low)), patch_of(std::move(high))};
}

/// Radiance is that of a blob of this power seen from afar: power over 2 pi size^2.
SoftLamp lamp_of(const Patch& patch) {
  const double square = (kWider * patch.spread() / 2 + kPixelsOwn * patch.own) / patch.power;
  const double radiance = patch.power / (2 * M_PI * square);
  return {patch.middle, std::sqrt(square), {radiance, radiance, radiance}};
}

std::vector<Spot> bright_spots(const Scene& scene) {
  const double ambient = luminance_of(ambient_of(scene));
  const std::size_t n = scene.photo.pixels();
  std::vector<Spot> spots;
  for (std::size_t i = 0; i < n; ++i) {
    const auto of = [&](const Image& map, std::size_t c) { return static_cast<double>(map.data[c * n + i]); };
    const double z = of(scene.depth, 0), seen = luminance(of(scene.photo, 0), of(scene.photo, 1), of(scene.photo, 2));
    if (!(z > 0 && seen > kBright * ambient && std::isfinite(seen))) continue;
    const auto width = static_cast<std::size_t>(scene.width());
    const Vec3 at =
        scene.camera.unproject(static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5, z);
    const Vec3 normal{of(scene.normal, 0), of(scene.normal, 1), of(scene.normal, 2)}, view = -glm::normalize(at);
    const double cosine = glm::dot(normal, view) / glm::length(normal);
    const double facing = cosine > kLeastFacing ? cosine : kLeastFacing;
    const double area = z * z / (scene.camera.fx * scene.camera.fy) * view.z / facing;
    spots.push_back({at, area, (seen - ambient) * area});
  }
  return spots;
}

}  // namespace

std::vector<SoftLamp> bright_patches(const Scene& scene) {
  std::vector<Spot> spots = bright_spots(scene);
  if (spots.empty()) return {};
  std::vector<Patch> patches{patch_of(std::move(spots))};
  const double small = kSmall * scene.scale();
  while (patches.size() < kPatches) {
    const auto spread = [&](const Patch& p) { return p.radius() < small ? 0 : p.spread(); };
    const auto widest = std::ranges::max_element(patches, {}, spread);
    if (spread(*widest) == 0) break;
    auto [low, high] = split(*widest);
    *widest = std::move(low);
    patches.push_back(std::move(high));
  }
  std::vector<SoftLamp> lamps;
  for (const Patch& patch : patches) lamps.push_back(lamp_of(patch));
  return lamps;
}

std::optional<Tensor> known_lamps(const Scene& scene, const RenderSettings& settings) {
  std::vector<SoftLamp> lamps = settings.lamps;
  if (traces_into_photograph(settings.light)) {
    const std::vector<SoftLamp> bright = bright_patches(scene);
    lamps.insert(lamps.end(), bright.begin(), bright.end());
  }
  const auto power = [](const SoftLamp& lamp) { return luminance_of(lamp.radiance) * lamp.size * lamp.size; };
  std::stable_sort(lamps.begin(), lamps.end(), [&](const auto& a, const auto& b) { return power(a) > power(b); });
  if (lamps.size() > kLamps) lamps.resize(kLamps);
  if (lamps.empty()) return {};
  const double ambient = luminance_of(ambient_of(scene));
  Tensor known(Shape{1, 5, 1, static_cast<int>(lamps.size())});
  for (int k = 0; k < known.shape.w; ++k) {
    const SoftLamp& lamp = lamps[static_cast<std::size_t>(k)];
    for (int c = 0; c < 3; ++c) known.at(0, c, 0, k) = lamp.place[c];
    known.at(0, 3, 0, k) = lamp.size;
    known.at(0, 4, 0, k) = luminance_of(lamp.radiance) / std::max(ambient, 1e-6);
  }
  return known;
}

}  // namespace clerestory
