#include "nets/scene_traits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "host/math/statistics.hpp"
#include "host/stopwatch.hpp"
#include "nets/learned_light.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

constexpr float kMirror = 0.1f;  // alpha 0.01
constexpr double kMeasuredRays = 1 << 20;
constexpr int kMeasuredTwice = 2;
constexpr int kEvery = 3;  // pixels whose depth and normal are compared

// Seconds of what is left out over those of a kernel of the same run.
constexpr double kLobesByDrawing = 0.03;  // drawing directions: rooms at 320x240, as is the next
constexpr double kTracingByDrawing = 1.4;

bool reads_hits(const RenderSettings& settings) {
  return traces_into_photograph(settings.light) || !settings.lamps.empty();
}

bool is_one_number(const float* plane, const std::vector<std::size_t>& pixels) {
  return std::ranges::all_of(pixels, [&](std::size_t i) { return plane[i] == plane[pixels.front()]; });
}

double seconds_of_kernels(const Rendering& r, const std::string& prefix) {
  double seconds = 0;
  for (const KernelProfile& k : r.kernels) seconds += k.kernel.starts_with(prefix) ? k.seconds : 0;
  return seconds;
}

double rays_answered(const Rendering& r, const std::string& part) {
  double rays = 0;
  for (const auto& [name, count] : r.answered) rays += name == part ? count : 0;
  return rays;
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

Saved shared_answers(const RenderSettings& settings, const Rendering& r) {
  const double rays = r.hits, answers = r.shared_answers;  // rays that miss would not be asked either
  const double asked = seconds_of_kernels(r, "light/ask_mlp"),
               looked_up = seconds_of_kernels(r, "light/direction_grid");
  return {Saving::SharedAnswers,
          fmt::format("{:.1f} million rays lie between {:.2f} million answers around what is seen", rays * 1e-6,
                      answers * 1e-6),
          rays - answers, (rays - answers) * in_view_flops(settings.nets->sizes.in_view),
          std::max(asked * (rays / answers - 1) - looked_up, 0.0)};
}

static_assert(kLeastShare == 1e-3);  // as kSavings says

Saved small_shares(const RenderSettings& settings, const Rendering& r) {
  const double near = rays_answered(r, "in view"), far = rays_answered(r, "out of view");
  const double in_view = seconds_of_kernels(r, "light/ask_mlp"),
               out_of_view = seconds_of_kernels(r, "light/ask_shells") + seconds_of_kernels(r, "light/ask_field");
  // All hits would be asked for in view, and all rays out of view.
  const auto rest = [&](double seconds, double asked, double all) {
    return asked > 0 ? seconds * (all / asked - 1) : 0;
  };
  const LightSizes& sizes = settings.nets->sizes;
  return {Saving::SmallShares,
          fmt::format("in view {:.1f} % of the rays are asked for, out of view {:.1f} %", percent(near, r.rays),
                      percent(far, r.rays)),
          r.hits + r.rays - near - far,
          (r.hits - near) * in_view_flops(sizes.in_view) + (r.rays - far) * out_of_view_flops(sizes.out_of_view),
          std::max(rest(in_view, near, r.hits) + rest(out_of_view, far, r.rays), 0.0)};
}

/// How long the re-render of a part of the rays takes: what is done once, and each chunk of rays.
struct Pace {
  double once = std::numeric_limits<double>::infinity(), a_chunk = once;
  int chunks = 0;  // of that part
};

Pace pace_of(Device& device, const Scene& scene, RenderSettings settings) {
  Pace pace;
  for (int i = 0; i < kMeasuredTwice; ++i) {  // the first builds kernels
    std::vector<double> done;
    const Stopwatch watch;
    settings.after_chunk = [&](int, int) { done.push_back(watch.seconds()); };
    const double seconds = render_scene(device, scene, settings).seconds;
    pace.chunks = static_cast<int>(done.size());
    const double chunks = pace.chunks;
    const double a_chunk = done.size() > 1 ? (done.back() - done.front()) / (chunks - 1) : seconds;
    pace.a_chunk = std::min(pace.a_chunk, a_chunk);
    pace.once = std::min(pace.once, std::max(seconds - chunks * a_chunk, 0.0));
  }
  return pace;
}

}  // namespace

double normals_off_depth(const Scene& scene) {
  std::vector<double> angles;
  const auto point = [&](int x, int y) {
    return scene.camera.unproject(x + 0.5, y + 0.5, static_cast<double>(scene.depth.at(0, y, x)));
  };
  for (int y = 0; y + 1 < scene.height(); y += kEvery)
    for (int x = 0; x + 1 < scene.width(); x += kEvery) {
      if (!(scene.depth.at(0, y, x) > 0 && scene.depth.at(0, y, x + 1) > 0 && scene.depth.at(0, y + 1, x) > 0))
        continue;
      const Vec3 here = point(x, y), across = glm::cross(point(x, y + 1) - here, point(x + 1, y) - here);
      const Vec3 normal{scene.normal.at(0, y, x), scene.normal.at(1, y, x), scene.normal.at(2, y, x)};
      const double cosine = glm::dot(across, normal) / (glm::length(across) * glm::length(normal));
      if (std::isfinite(cosine)) angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi);
    }
  return angles.empty() ? 0 : median(angles);
}

double mirrors_of(const Scene& scene) {
  double shown = 0, mirrors = 0;
  for (std::size_t i = 0; i < scene.depth.data.size(); ++i) {
    if (!(scene.depth.data[i] > 0)) continue;
    ++shown, mirrors += scene.material.data[i] <= kMirror;
  }
  return shown > 0 ? mirrors / shown : 0;
}

SceneTraits traits_of(const Scene& scene, const RenderSettings& settings) {
  SceneTraits traits;
  traits.normals_off = normals_off_depth(scene);
  traits.traces = reads_hits(settings), traits.lamps = settings.lamps.size();
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < scene.depth.data.size(); ++i)
    if (scene.depth.data[i] > 0) shown.push_back(i);
  if (shown.empty()) return traits;
  const auto all = static_cast<double>(shown.size());
  const float *roughness = scene.material.plane(0), *metallic = scene.material.plane(1),
              *flag = scene.material.plane(2);
  const auto share = [&](auto is) { return static_cast<double>(std::ranges::count_if(shown, is)) / all; };
  traits.surfaces = all / static_cast<double>(scene.depth.data.size());
  traits.metals = share([&](std::size_t i) { return metallic[i] > 0.5f; });
  traits.any_metal = share([&](std::size_t i) { return metallic[i] > 0; });
  traits.mirrors = mirrors_of(scene);
  traits.emitters = share([&](std::size_t i) { return flag[i] > 0; });
  const auto [least, most] = std::ranges::minmax(shown, {}, [&](std::size_t i) { return roughness[i]; });
  traits.least_roughness = roughness[least], traits.most_roughness = roughness[most];
  traits.constant_maps = is_one_number(roughness, shown) && is_one_number(metallic, shown);
  for (int c = 0; c < 3; ++c) traits.constant_maps &= is_one_number(scene.albedo.plane(c), shown);
  return traits;
}

std::string describe(const SceneTraits& t) {
  std::string text = fmt::format(
      "roughness {:.2f} to {:.2f}{}; {:.1f} % of the surfaces are metal, {:.1f} % mirrors, "
      "{:.1f} % emit; {} lamps out of view; normals {:.1f} degrees off the depth",
      t.least_roughness, t.most_roughness, t.constant_maps ? ", one material" : "", 100 * t.metals, 100 * t.mirrors,
      100 * t.emitters, t.lamps, t.normals_off);
  if (t.surfaces < 1) text += fmt::format("; {:.1f} % of the picture has no depth", 100 * (1 - t.surfaces));
  return text;
}

std::vector<Saved> saved_in(const SceneTraits& traits, const RenderSettings& settings, const Rendering& r) {
  std::vector<Saved> saved;
  const auto in_effect = [&](Saving saving) { return settings.leave_out.contains(saving); };
  const double drawn = seconds_of_kernels(r, "shade/sample_brdf.cl");
  if (r.shared_answers > 0) saved.push_back(shared_answers(settings, r));
  if (!r.answered.empty()) saved.push_back(small_shares(settings, r));
  if (traits.lamps == 0 && in_effect(Saving::Lobes))
    saved.push_back({Saving::Lobes, "no lamp is fitted", r.rays, 0, kLobesByDrawing * drawn});
  if (!traits.traces && in_effect(Saving::Tracing))
    saved.push_back({Saving::Tracing, "the light does not ask where rays end", r.rays, 0, kTracingByDrawing * drawn});
  return saved;
}

std::map<Saving, double> measure_savings(Device& device, const Scene& scene, const RenderSettings& settings,
                                         const Rendering& rendering) {
  RenderSettings part = settings;
  part.profile = false;
  part.sharing = rendering.shared_answers > 0 ? Sharing::Always : Sharing::Never;
  const double rays = static_cast<double>(scene.photo.pixels()) * part.spp;
  part.every_chunk = std::max(1, static_cast<int>(rays / kMeasuredRays));
  const Pace all = pace_of(device, scene, part);
  const double chunks = static_cast<double>(all.chunks) * part.every_chunk;
  std::map<Saving, double> seconds;
  for (const Saved& saved : saved_in(traits_of(scene, settings), settings, rendering)) {
    RenderSettings without = part;
    without.leave_out.erase(saved.saving);
    if (saved.saving == Saving::SharedAnswers) without.sharing = Sharing::Never;
    const Pace pace = pace_of(device, scene, without);
    seconds[saved.saving] = pace.once - all.once + chunks * (pace.a_chunk - all.a_chunk);
  }
  return seconds;
}

}  // namespace clerestory
