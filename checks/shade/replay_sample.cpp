// What a drawn direction came from, written again from the numbers and frames that the kernels promise.
#include "host/ops/shade/replay_sample.hpp"

#include "checks/shade/sample_brdf_reference.hpp"
#include "checks/shade/sobol_reference.hpp"
#include "host/math/frames.hpp"

namespace clerestory {
namespace {

using namespace sample_brdf_reference;

constexpr int kSamples = 16;
constexpr std::uint32_t kSeed = 5, kSalt = 0x62726466u;

Tensor replayed(const Tensors& t, Points points) {
  Tensor y(Shape{1, 21, kRows, kSamples});
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < kSamples; ++s) {
      std::vector<double> values;
      if (points == Points::Sobol)
        for (const std::uint32_t bits :
             scrambled_sobol_reference(kSeed ^ kSalt, static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(s), 0))
          values.push_back(unit_of(bits));
      else
        for (const double u : hashed(kSeed ^ kSalt, static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(s), 0))
          values.push_back(u);
      const Frame frame = frame_around(glm::normalize(pixel_of(t.at("normal"), p)));
      const Camera eye = camera_in(t);
      const int pixel = p % kPlane;
      const Vec3 view = -eye.direction(pixel % kWidth + 0.5, pixel / kWidth + 0.5);
      const Vec3 light{t.at("direction").at(0, 0, p, s), t.at("direction").at(0, 1, p, s),
                       t.at("direction").at(0, 2, p, s)};
      const Vec3 wo = frame.to_local(view);
      for (const Vec3& v : {frame.x, frame.y, frame.z, wo, frame.to_local(light)})
        values.insert(values.end(), {v.x, v.y, v.z});
      const SurfaceReference surface = surface_of(t, "", p);
      values.insert(values.end(), {surface.alpha(), surface.specular_probability(wo)});
      for (std::size_t c = 0; c < values.size(); ++c) y.at(0, static_cast<int>(c), p, s) = values[c];
    }
  return y;
}

OpCase replay_case(const char* label, Points points) {
  OpCase c{.stem = "replay_sample", .label = label, .kernels = {"replay_sample"}};
  c.inputs = maps(91);
  c.inputs.erase("depth");
  c.inputs["direction"] = random_tensor({1, 3, kRows, kSamples}, 92);
  c.build = [points](Graph&, const Values& v) {
    return std::vector<Value>{replay_sample(v.at("camera"), {v.at("albedo"), v.at("normal"), v.at("material")},
                                            v.at("direction"), {.points = points})};
  };
  c.reference = [points](const Tensors& t) { return std::vector<Tensor>{replayed(t, points)}; };
  c.roundings = 32, c.magnitude = 1;  // products of three and a normalisation, of unit vectors
  c.seed = kSeed;
  c.no_gradient = "is for people to read";
  return c;
}

OP_CASES(replay_sample) { return {replay_case("sobol", Points::Sobol), replay_case("hash", Points::Independent)}; }

}  // namespace
}  // namespace clerestory
