// Rays that go on from inserted objects, against visible normals by a spherical cap written again in double.
#include "host/ops/shade/bounce.hpp"

#include <cmath>
#include <random>

#include "checks/op_case.hpp"
#include "checks/shade/hash_reference.hpp"
#include "checks/shade/sampler_reference.hpp"
#include "host/math/frames.hpp"

namespace clerestory {
namespace {

using namespace sampler_reference;

constexpr int kRows = 12, kSamples = 16, kObjects = 3, kNumber = 2;

constexpr std::uint32_t kSalt = 0x626f756eu;

/// Rays that travel downwards onto normals that point up, some objects hit, some not, one normal turned away.
Tensors inputs() {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  Tensors t{{"direction", Tensor(Shape{1, 3, kRows, kSamples})},
            {"specular", random_tensor({1, 3, kRows, kSamples}, 5, 0, 1)},
            {"lobe", random_tensor({1, 1, kRows, kSamples}, 4, 0, 2)},
            {"normal", Tensor(Shape{1, 3, kRows, kSamples})},
            {"object", random_ints({1, 1, kRows, kSamples}, 2, -1, kObjects - 1)},
            {"materials", random_tensor({kObjects, 5, 1, 1}, 3, 0.1, 0.9)}};
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < kSamples; ++s)
      for (int c = 0; c < 3; ++c) {
        t["normal"].at(0, c, p, s) = 0.3 * normal(random) + (c == 1);
        t["direction"].at(0, c, p, s) = 0.5 * normal(random) - (c == 1);
      }
  t["normal"].at(0, 1, 0, 0) = -1;
  for (int k = 0; k < kObjects; ++k) t["materials"].at(k, 3, 0, 0) = 0.3 + 0.3 * k;
  return t;
}

std::vector<Tensor> reference(const Tensors& t, std::uint32_t seed) {
  Tensor next(Shape{1, 3, kRows, kSamples}), weight = next, specular = next, widest(Shape{1, 1, kRows, kSamples});
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < kSamples; ++s) {
      const int object = t.at("object").integer[static_cast<std::size_t>(p * kSamples + s)];
      if (object < 0) continue;
      const auto ray = [&](const char* name) {
        return Vec3(t.at(name).at(0, 0, p, s), t.at(name).at(0, 1, p, s), t.at(name).at(0, 2, p, s));
      };
      const auto material = [&](int c) { return t.at("materials").at(object, c, 0, 0); };
      const SurfaceReference surface{{material(0), material(1), material(2)}, material(3), material(4)};
      const Frame frame = frame_around(glm::normalize(ray("normal")));
      const Vec3 wo = frame.to_local(-glm::normalize(ray("direction")));
      if (wo.z <= 0) continue;
      const std::array<double, 4> u = hashed(seed ^ kSalt, static_cast<unsigned>(p), static_cast<unsigned>(s), kNumber);
      const double chance = surface.specular_probability(wo);
      const Vec3 wi = drawn(kCaps, surface, wo, chance, u[0], u[1], u[2]);
      if (wi.z <= 0) continue;
      const Vec3 towards = frame.from_local(wi), worth = surface.f_cos(wo, wi) / surface.pdf(0, wo, wi, chance);
      for (int c = 0; c < 3; ++c) next.at(0, c, p, s) = towards[c], weight.at(0, c, p, s) = worth[c];
      if (!t.contains("lobe")) continue;
      widest.at(0, 0, p, s) = std::min(t.at("lobe").at(0, 0, p, s), surface.specular_pdf(0, wo, wi));
      const Vec3 share = surface.specular_share(wo, wi);
      for (int c = 0; c < 3; ++c) specular.at(0, c, p, s) = t.at("specular").at(0, c, p, s) * share[c];
    }
  if (!t.contains("lobe")) return {next, weight};
  return {next, weight, specular, widest};
}

OP_CASES(bounce) {
  OpCase c{.stem = "bounce", .label = "objects", .kernels = {"bounce"}, .inputs = inputs()};
  c.build = [](Graph&, const Values& v) {
    const Lobes arriving = v.contains("lobe") ? Lobes{v.at("specular"), v.at("lobe")} : Lobes{};
    const Bounce b = bounce(v.at("direction"), v.at("normal"), v.at("object"), v.at("materials"), arriving, kNumber);
    if (!arriving) return std::vector<Value>{b.direction, b.weight};
    return std::vector<Value>{b.direction, b.weight, b.lobes.specular, b.lobes.density};
  };
  c.reference = [seed = c.seed](const Tensors& t) { return reference(t, seed); };
  // Directions go through two frames and a reflection; grazing ones magnify that in the weight.
  c.roundings = 200;
  c.no_gradient = "for applications, detached";
  OpCase without = c;
  without.label = "without_lobes";
  without.inputs.erase("specular"), without.inputs.erase("lobe");
  return {c, without};
}

}  // namespace
}  // namespace clerestory
