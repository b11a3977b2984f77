#include "nets/light_training.hpp"

#include "host/error.hpp"
#include "host/math/radiance.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/nn/moving_average.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reciprocal.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "nets/builder.hpp"

namespace clerestory {
namespace {

/// `known`, 1 on rays that hit alone.
Value known_hits(Value known, const SsrtHits& hits, const LitPicture& p) {
  const Value everywhere = p.scene.depth.graph().fill(p.scene.depth.shape(), 1);
  return multiply(known, gather_rays(everywhere, hits.pixel));
}

Value mean_of(const std::vector<Value>& terms) {
  Value total;
  for (const Value& t : terms) total = total ? add(total, t) : t;
  return scale(total, 1.0 / static_cast<double>(terms.size()));
}

/// 1 / sqrt(y^2 + floor): what makes an error of y a relative one.
Value inverse_size(Value y) { return reciprocal_root(affine(activate(y, Function::Square), 1, kLightFloor)); }

/// 1 / (y + floor), through which no gradient goes.
Value inverse_of_prediction(Value y, double floor) { return detach(reciprocal(affine(y, 1, floor))); }

/// {1, 1, pixels, samples}: 1 for the first half of a pixel's samples, -1 for the second.
Tensor half_signs(int pixels, int samples) {
  Tensor signs(Shape{1, 1, pixels, samples}, 1);
  for (std::size_t i = 0; i < signs.real.size(); ++i)
    if (2 * (static_cast<int>(i) % samples) >= samples) signs.real[i] = -1;
  return signs;
}

/// The pixels that are rendered again, of the whole batch.
struct Shading {
  Surfaces surfaces;
  Value depth, camera, image, mask;
};

Shading shading_inputs(Graph& graph, const LightTrainingOptions& o) {
  const auto map = [&](const char* name, int channels) {
    return graph.input(name, {o.batch, channels, o.shade_height, o.shade_width});
  };
  return {{map("shade_albedo", 3), map("shade_normal", 3), map("shade_material", 3)},
          map("shade_depth", 1),
          graph.input("shade_camera", {o.batch, 4, 1, 1}),
          map("shade_image", 3),
          map("shade_mask", 1)};
}

/// Squared error of picture b rendered again under the light that `ask`(points, directions, skip) answers. A square of
/// noisy sums would also charge their variance, and with it every small bright lamp; the product of two independent
/// halves' errors does not: (a - y)(b - y) = ((a + b) / 2 - y)^2 - ((a - b) / 2)^2. `relative`: over y^2 + floor.
template <class Ask>
Value rerender_loss(Graph& graph, const Shading& all, int b, int samples, bool relative, const Ask& ask) {
  const Surfaces surfaces{item_of(all.surfaces.albedo, b), item_of(all.surfaces.normal, b),
                          item_of(all.surfaces.material, b)};
  const Value depth = item_of(all.depth, b), camera = item_of(all.camera, b), image = item_of(all.image, b);
  const int pixels = static_cast<int>(depth.shape().plane());
  const BrdfSamples drawn =
      sample_brdf(depth, camera, surfaces, surfaces, pixels, samples, {.points = Points::Independent});
  // All samples of a pixel start at its point.
  const Value origins = ray_origins(surface_points(depth, camera), samples);
  const Value skip = graph.input("shade_skip" + std::to_string(b), {1, 1, pixels, samples}, Type::Int);
  const LightAnswer answer = ask(origins, drawn.direction, skip);
  const auto summed = [&](Value weight) {
    return reshape(accumulate_samples(weight, answer.mixed, drawn.pdf, {}, {}, samples).mean, image.shape());
  };
  const Value mask = item_of(all.mask, b), whole = summed(drawn.weight);
  const Value apart = summed(multiply(drawn.weight, graph.constant(half_signs(pixels, samples))));
  const auto weighed = [&](Value v) { return relative ? multiply(v, inverse_size(image)) : v; };
  return subtract(squared_loss(weighed(whole), weighed(image), mask, 1.0 / 3),
                  squared_loss(weighed(apart), graph.fill(image.shape(), 0), mask, 1.0 / 3));
}

/// The terms of a picture under the light's net of Li et al.
Value li2020_recon(Value answer, Value truth, Value known) {
  return log_loss(answer, truth, known, 10.0 / 3, least_squares_scale(answer, truth, known));
}

Value li2020_rerender(const Gaussians& lobes, const LightInputs& picture) {
  const Value image = li2020_seen_cells(picture);
  const Li2020Shaded shaded = li2020_rescaled(li2020_shaded(lobes, picture), image);
  return squared_loss(li2020_shown(shaded), image, li2020_lit_cells(picture), 1.0 / 3);
}

LightInputs picture_of(const LightInputs& all, int b) {
  const Surfaces& s = all.surfaces;
  return {item_of(all.image, b),
          item_of(all.depth, b),
          {item_of(s.albedo, b), item_of(s.normal, b), item_of(s.material, b)},
          item_of(all.camera, b),
          item_of(all.range, b)};
}

}  // namespace

Value hdr_loss(Value prediction, Value truth, Value mask) {
  const Value inverse = inverse_of_prediction(prediction, 1e-3);
  return squared_loss(multiply(prediction, inverse), multiply(truth, inverse), mask, 1.0 / 3);
}

Value relative_loss(Value prediction, Value truth, Value mask) {
  const auto log = [](Value x) { return activate(affine(x, 1, kLightFloor), Function::Log); };
  const Value inverse = inverse_size(truth);
  return add(squared_loss(log(prediction), log(truth), mask, 1.0 / 3),
             squared_loss(multiply(prediction, inverse), multiply(truth, inverse), mask, 1.0 / 3), 0.25);
}

Value irradiance_loss(Value prediction, Value truth) {
  const Shape& s = prediction.shape();
  const int rows = s.c * s.h;
  const auto means = [&](Value v) { return affine(plane_mean(reshape(v, {1, rows, s.w, 1})), 1, kLightFloor); };
  const auto log = [](Value x) { return activate(x, Function::Log); };
  const Value ours = means(prediction), theirs = means(truth);
  const Value divergence = add(multiply(theirs, subtract(log(theirs), log(ours))), subtract(ours, theirs));
  return plane_mean(reshape(divergence, {1, 1, rows, 1}));
}

RadianceLoss radiance_loss_of(const std::string& name) {
  if (name == "hdr") return RadianceLoss::Hdr;
  if (name == "relative") return RadianceLoss::Relative;
  throw usage_error("there is no such loss of radiance", "loss.radiance", name, "hdr or relative");
}

LightTraining light_training(Graph& graph, const LightSizes& sizes, const LightTrainingOptions& o) {
  const LightLossWeights& w = o.weights;
  if (w.mixed + w.out_of_view + w.rerender + w.irradiance + w.unseen == 0)
    throw usage_error("every term has a weight of zero: nothing to train", "loss");
  if (sizes.li2020 && w.out_of_view + w.irradiance + w.unseen > 0)
    throw usage_error("the light of Li et al. has no such terms", "loss.out_of_view, loss.irradiance, loss.unseen",
                      "above 0", "0");
  const LightInputs inputs = light_inputs(graph, o.batch, o.height, o.width);
  const std::vector<LitPicture> pictures = lit_pictures(graph, inputs, sizes, true);
  const Shading shading = w.rerender > 0 && !sizes.li2020 ? shading_inputs(graph, o) : Shading{};

  const bool relative = o.radiance == RadianceLoss::Relative;
  const auto radiance_loss = relative ? relative_loss : hdr_loss;
  std::vector<Value> mixed, far, unseen, irradiance, rerender;
  for (int b = 0; b < o.batch; ++b) {
    graph.draws(static_cast<std::uint32_t>(b) + 1);  // each picture its own directions
    const LitPicture& picture = pictures[static_cast<std::size_t>(b)];
    const auto ask = [&](Value points, Value directions, Value skip) {
      return ask_light(graph, picture, sizes, points, directions, skip);
    };
    if (w.mixed + w.out_of_view + w.irradiance + w.unseen > 0) {
      const auto rays = [&](const char* name, int channels, Type type = Type::Real) {
        return graph.input(name + std::to_string(b), {1, channels, o.rows, o.samples}, type);
      };
      const Value truth = rays("light", 3), known = rays("known", 1);
      const LightAnswer answer = ask(rays("points", 3), rays("directions", 3), rays("skip", 1, Type::Int));
      mixed.push_back(sizes.li2020 ? li2020_recon(answer.mixed, truth, known)
                                   : radiance_loss(answer.mixed, truth, known_hits(known, answer.hits, picture)));
      far.push_back(radiance_loss(answer.out_of_view, truth, known));
      unseen.push_back(radiance_loss(answer.out_of_view, truth, multiply(known, answer.hits.u)));
      irradiance.push_back(irradiance_loss(answer.mixed, truth));
    }
    if (w.rerender > 0 && sizes.li2020)
      rerender.push_back(li2020_rerender(picture.lobes, picture_of(inputs, b)));
    else if (w.rerender > 0)
      rerender.push_back(rerender_loss(graph, shading, b, o.shade_samples, relative, ask));
  }
  graph.draws(0);

  LightTraining training;
  Value total;
  const auto term = [&](const char* name, const std::vector<Value>& values, double weight) {
    if (weight == 0) return;
    training.losses.emplace_back(name, scale(mean_of(values), weight));
    total = total ? add(total, training.losses.back().second) : training.losses.back().second;
  };
  term("mixed", mixed, w.mixed), term("out_of_view", far, w.out_of_view);
  term("irradiance", irradiance, w.irradiance), term("rerender", rerender, w.rerender);
  term("unseen", unseen, w.unseen);
  training.losses.insert(training.losses.begin(), {"loss", total});
  if (w.mixed + w.rerender + w.irradiance == 0) training.frozen = {"local"};
  training.parameters = trained_parameters(graph, training.frozen);
  const Value rate = graph.input("learning_rate", {}), step = graph.input("step", {});
  training.squares = adam(training.parameters, gradient(total, training.parameters), rate, step, o.adam);
  if (o.average > 0) moving_average(training.parameters, step, o.average);
  return training;
}

}  // namespace clerestory
