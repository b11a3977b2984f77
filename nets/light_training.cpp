#include "nets/light_training.hpp"

#include "host/error.hpp"
#include "host/ops/light/depth_pyramid.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"

namespace clerestory {
namespace {

/// Whole-batch inputs that rays are traced against.
struct Pictures {
  Value image, depth, normal, camera, range;
};

/// One picture of them, with its pyramid.
struct Picture {
  Value image, depth, pyramid, normal, camera, range;
};

Picture picture_at(const Pictures& all, Value pyramid, int b) {
  return {picture_of(all.image, b),  picture_of(all.depth, b),  picture_of(pyramid, b),
          picture_of(all.normal, b), picture_of(all.camera, b), picture_of(all.range, b)};
}

/// The light as both nets of one picture answer it.
struct Answer {
  Value mixed, far;  // `mixed` is empty where nobody asked
  SsrtHits hits;
};

struct LightModel {
  const LightNetSize& in_view;
  const OutOfViewSize& out_of_view;
  Scope local;

  Answer ask(const Picture& p, const LightPixels& pixels, const LightField& field, Value points, Value directions,
             Value skip) const {
    Answer answer;
    answer.hits = ssrt(p.depth, p.pyramid, p.camera, p.range, directions, p.normal, {points, skip});
    answer.far = out_of_view_light(field, points, directions, p.range, out_of_view);
    const Value near = in_view_light(local, pixels, answer.hits.pixel, directions, p.image, in_view);
    answer.mixed = mix_light(near, answer.far, answer.hits.u);
    return answer;
  }
};

/// `known`, 1 on rays that hit alone.
Value known_hits(Value known, const SsrtHits& hits, const Picture& p) {
  const Value everywhere = p.depth.graph().fill(p.depth.shape(), 1);
  return multiply(known, gather_rays(everywhere, hits.pixel));
}

Value mean_of(const std::vector<Value>& terms) {
  Value total;
  for (const Value& t : terms) total = total ? add(total, t) : t;
  return scale(total, 1.0 / static_cast<double>(terms.size()));
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

/// Squared error of picture b rendered again under the light that `ask`(points, directions, skip) answers.
template <class Ask>
Value rerender_loss(Graph& graph, const Shading& all, int b, int samples, const Ask& ask) {
  const Surfaces surfaces{picture_of(all.surfaces.albedo, b), picture_of(all.surfaces.normal, b),
                          picture_of(all.surfaces.material, b)};
  const Value depth = picture_of(all.depth, b), camera = picture_of(all.camera, b), image = picture_of(all.image, b);
  const int pixels = static_cast<int>(depth.shape().plane());
  const BrdfSamples drawn = sample_brdf(depth, camera, surfaces, surfaces, pixels, samples);
  // All samples of a pixel start at its point.
  const Value points = reshape(surface_points(depth, camera), {3 * pixels, 1, 1, 1});
  const Value origins = reshape(expand(points, {3 * pixels, 1, 1, samples}), {1, 3, pixels, samples});
  const Value skip = graph.input("shade_skip" + std::to_string(b), {1, 1, pixels, samples}, Type::Int);
  const Answer answer = ask(origins, drawn.direction, skip);
  const Value sums = accumulate_samples(drawn.weight, answer.mixed, drawn.pdf, {}, {}, samples).mean;
  return squared_loss(reshape(sums, image.shape()), image, picture_of(all.mask, b), 1.0 / 3);
}

}  // namespace

Value hdr_loss(Value prediction, Value truth, Value mask) {
  constexpr double floor = 1e-3;
  const Value inverse = detach(activate(scale(activate(affine(prediction, 1, floor), Function::Log), -1), Function::Exp));
  return squared_loss(multiply(prediction, inverse), multiply(truth, inverse), mask, 1.0 / 3);
}

LightTraining light_training(Graph& graph, const LightNetSize& in_view, const OutOfViewSize& out_of_view,
                             const LightTrainingOptions& o) {
  const LightLossWeights& w = o.weights;
  if (w.mixed + w.out_of_view + w.rerender == 0)
    throw usage_error("every term has a weight of zero: nothing to train", "loss");
  const auto map = [&](const std::string& name, int channels, int h, int wide) {
    return graph.input(name, {o.batch, channels, h, wide});
  };
  const Pictures all{map("image", 3, o.height, o.width), map("depth", 1, o.height, o.width),
                     map("normal", 3, o.height, o.width), map("camera", 4, 1, 1), map("range", 3, 1, 1)};
  const Surfaces surfaces{map("albedo", 3, o.height, o.width), all.normal, map("material", 3, o.height, o.width)};
  const Scope local{graph, true, "local"}, global{graph, true, "global"};
  const std::vector<LightPixels> pixels = light_pixels_of_batch(local, all.image, surfaces, in_view);
  const std::vector<LightField> fields = light_fields(global, all.image, out_of_view);
  const Value pyramid = depth_pyramid(all.depth);
  const LightModel model{in_view, out_of_view, local};
  const Shading shading = w.rerender > 0 ? shading_inputs(graph, o) : Shading{};

  std::vector<Value> mixed, far, rerender;
  for (int b = 0; b < o.batch; ++b) {
    const std::size_t i = static_cast<std::size_t>(b);
    const Picture picture = picture_at(all, pyramid, b);
    const auto ask = [&](Value points, Value directions, Value skip) {
      return model.ask(picture, pixels[i], fields[i], points, directions, skip);
    };
    if (w.mixed > 0 || w.out_of_view > 0) {
      const auto rays = [&](const char* name, int channels, Type type = Type::Real) {
        return graph.input(name + std::to_string(b), {1, channels, o.rows, o.samples}, type);
      };
      const Value truth = rays("light", 3), known = rays("known", 1);
      const Answer answer = ask(rays("points", 3), rays("directions", 3), rays("skip", 1, Type::Int));
      mixed.push_back(hdr_loss(answer.mixed, truth, known_hits(known, answer.hits, picture)));
      far.push_back(hdr_loss(answer.far, truth, known));
    }
    if (w.rerender > 0) rerender.push_back(rerender_loss(graph, shading, b, o.shade_samples, ask));
  }

  LightTraining training;
  Value total;
  const auto term = [&](const char* name, const std::vector<Value>& values, double weight) {
    if (weight == 0) return;
    training.losses.emplace_back(name, scale(mean_of(values), weight));
    total = total ? add(total, training.losses.back().second) : training.losses.back().second;
  };
  term("mixed", mixed, w.mixed), term("out_of_view", far, w.out_of_view), term("rerender", rerender, w.rerender);
  training.losses.insert(training.losses.begin(), {"loss", total});
  const std::vector<Value> parameters = graph.parameters();
  adam(parameters, gradient(total, parameters), graph.input("learning_rate", {}), graph.input("step", {}), o.adam);
  return training;
}

}  // namespace clerestory
