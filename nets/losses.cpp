#include "nets/losses.hpp"

#include "host/error.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/nn/pool.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reciprocal.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"
#include "nets/vgg.hpp"

namespace clerestory {
namespace {

/// Of sums over masks and the masks' own: the means; of an empty mask 0.
Value mean_of(Value sum, Value weight) { return multiply(sum, reciprocal(affine(weight, 1, 1e-6))); }

/// Mean of a map over its mask, of each picture or of all, as `shape` says; of an empty mask 0.
Value masked_mean(Value map, Value mask, const Shape& shape) {
  const Value pixels = sum_to(mask, shape);
  return mean_of(sum_to(multiply(map, mask), shape), pixels);
}

struct MapTerms {
  Value albedo, normal, material, depth;
};

/// Depth is compared alike by both: after one scale a picture, in logarithms.
Value scaled_depth_loss(const Maps& maps, const MapTargets& truth, double factor) {
  const Value aligned = least_squares_scale(maps.depth, truth.depth, truth.geometry_mask);
  return log_loss(maps.depth, truth.depth, truth.geometry_mask, factor, aligned);
}

constexpr double kDepthFloor = 0.01;

Value log_of(Value map, double floor) { return activate(affine(map, 1, floor), Function::Log); }

Value log_error(Value prediction, Value truth, double floor) {
  return subtract(log_of(prediction, floor), log_of(truth, floor));
}

Value absolute(Value x) { return add(relu(x), relu(scale(x, -1))); }

MapTerms li2020_terms(const Maps& maps, const MapTargets& truth) {
  const Value aligned = least_squares_scale(detach(maps.albedo), truth.albedo, truth.albedo_mask);
  const Value albedo = clamp_to_unit(multiply(maps.albedo, aligned));
  const Value rough = slice(maps.material, 0, 1), true_rough = slice(truth.material, 0, 1);
  return {squared_loss(albedo, truth.albedo, truth.albedo_mask, 4 * 1.5 / 3),
          squared_loss(maps.normal, truth.normal, truth.geometry_mask, 4 * 1.0 / 3),
          squared_loss(rough, true_rough, truth.material_mask, 4 * 0.5 * 4), scaled_depth_loss(maps, truth, 4 * 0.5)};
}

MapTerms zhu_terms(const Scope& scope, const Maps& maps, const MapTargets& truth, double perceptual,
                   const PerceptualFeatures& through) {
  MapTerms terms{log_loss(maps.albedo, truth.albedo, truth.albedo_mask, 0.5 / 3),
                 cosine_loss(maps.normal, truth.normal, truth.geometry_mask, 0.5),
                 squared_loss(maps.material, truth.material, truth.material_mask, 0.5),
                 scaled_depth_loss(maps, truth, 1)};
  if (perceptual == 0) return terms;
  const auto distance = [&](Value prediction, Value wanted, Value mask) {
    return perceptual_distance(scope / through.scope(), prediction, wanted, mask, through);
  };
  // Nets of pictures have seen nothing below 0; the paper's form leaves normals as they are.
  const auto seen = [&](Value normal) {
    return through.from == PerceptualFeatures::From::Imported ? normal : affine(normal, 0.5, 0.5);
  };
  terms.albedo = add(terms.albedo, distance(maps.albedo, truth.albedo, truth.albedo_mask), 0.5 * perceptual);
  terms.normal =
      add(terms.normal, distance(seen(maps.normal), seen(truth.normal), truth.geometry_mask), 0.5 * perceptual);
  for (const int map : {0, 1})
    terms.material =
        add(terms.material, distance(slice(maps.material, map, 1), slice(truth.material, map, 1), truth.material_mask),
            0.25 * perceptual);
  return terms;
}

}  // namespace

MapLosses map_losses_of(const std::string& name) {
  if (name == "zhu") return MapLosses::Zhu;
  if (name == "li2020") return MapLosses::Li2020;
  throw usage_error("there are no such terms", "loss.terms", name, "zhu or li2020");
}

Value perceptual_distance(const Scope& scope, Value prediction, Value truth, Value mask,
                          const PerceptualFeatures& through) {
  using From = PerceptualFeatures::From;
  const auto features = [&](Value map) {
    const Shape& s = map.shape();
    const Value masked = multiply(map, mask), shown = s.c == 3 ? masked : expand(masked, {s.n, 3, s.h, s.w});
    if (through.from != From::Rooms) return vgg_features(scope, shown);
    return mgnet_encoder(Scope{scope.graph, false, scope.name, true} / "encoder", shown, through.encoder)[1];
  };
  const Value a = features(prediction), b = features(truth), known = average_pool(average_pool(mask));
  const double share = 1.0 / a.shape().c;
  const Value distance = squared_loss(a, b, known, share);
  if (through.from == From::Imported) return distance;
  constexpr double nothing = 1e-6;  // of an empty mask both are 0
  return multiply(distance, reciprocal(affine(masked_mean(multiply(b, b), known, {1, 1, 1, 1}), share, nothing)));
}

Value log_depth_loss(Value prediction, Value truth, Value mask) {
  constexpr double share_removed = 0.85;
  const Value predicted = log_of(prediction, kDepthFloor), wanted = log_of(truth, kDepthFloor);
  const Value mean = detach(masked_mean(subtract(predicted, wanted), mask, {truth.shape().n, 1, 1, 1}));
  return squared_loss(predicted, add(wanted, expand(mean, truth.shape()), share_removed), mask);
}

Value detail_loss(Value error, Value mask) {
  constexpr int scales = 4;
  Value sum = multiply(error, mask), weight = mask, total;
  for (int i = 0; i < scales; ++i) {
    const Shape fine = sum.shape();
    const auto grown = [&](Value x) { return resize_bilinear(x, fine.h, fine.w, Aligned::Centres); };
    const Value wide = average_pool(sum), wide_weight = average_pool(weight);
    const Value band = subtract(mean_of(sum, weight), mean_of(grown(wide), grown(wide_weight)));
    const Value term = masked_mean(absolute(band), weight, {1, 1, 1, 1});
    total = total ? add(total, term) : term;
    sum = wide, weight = wide_weight;
  }
  return scale(total, 1.0 / error.shape().c);
}

Value metallic_entropy(Value prediction, Value truth, Value mask) {
  constexpr double floor = 0.01;
  const Value metal = multiply(truth, log_of(prediction, floor));
  const Value rest = activate(affine(prediction, -1, 1 + floor), Function::Log);
  const Value other = multiply(affine(truth, -1, 1), rest);
  return masked_mean(scale(add(metal, other), -1), mask, {1, 1, 1, 1});
}

Value judgement_loss(Value albedo, const JudgedAlbedo& judged) {
  constexpr double floor = 0.001, margin = 0.5;
  const Shape& s = albedo.shape();
  const Value lightness = sum_to(albedo, {s.n, 1, s.h, s.w});
  const Value log = reshape(activate(affine(lightness, 1.0 / 3, floor), Function::Log), {1, 1, s.n * s.h, s.w});
  const Value apart = subtract(gather_rays(log, judged.first), gather_rays(log, judged.second));
  const Value wrong = relu(affine(apart, 1, margin));
  const Value each =
      add(multiply(judged.equal, multiply(apart, apart)), multiply(judged.ordered, multiply(wrong, wrong)));
  return scale(sum_to(each, {1, 1, 1, 1}), 2);
}

NamedValues mgnet_losses(const Scope& scope, const Maps& maps, const MapTargets& truth, const LossWeights& weights) {
  const MapTerms compared = weights.terms == MapLosses::Li2020
                                ? li2020_terms(maps, truth)
                                : zhu_terms(scope, maps, truth, weights.perceptual, weights.features);
  NamedValues terms;
  Value total;
  const auto term = [&](const char* name, Value value, double weight) {
    if (weight == 0) return;
    terms.emplace_back(name, weight == 1 ? value : scale(value, weight));
    total = total ? add(total, terms.back().second) : terms.back().second;
  };
  term("albedo", compared.albedo, weights.albedo);
  term("normal", compared.normal, weights.normal);
  term("material", compared.material, weights.material);
  term("depth", compared.depth, weights.depth);
  if (weights.log_depth > 0)
    term("log_depth", log_depth_loss(maps.depth, truth.depth, truth.geometry_mask), weights.log_depth);
  if (weights.depth_detail > 0)
    term("depth_detail", detail_loss(log_error(maps.depth, truth.depth, kDepthFloor), truth.geometry_mask),
         weights.depth_detail);
  if (weights.albedo_detail > 0)
    term("albedo_detail", detail_loss(log_error(maps.albedo, truth.albedo, 1), truth.albedo_mask),
         weights.albedo_detail);
  if (weights.metallic > 0)
    term("metallic", metallic_entropy(slice(maps.material, 1, 1), slice(truth.material, 1, 1), truth.material_mask),
         weights.metallic);
  if (truth.judged.first) term("judgements", judgement_loss(maps.albedo, truth.judged), weights.judgements);
  term("scale", squared_loss(maps.log_scale, truth.log_scale, truth.scale_mask), weights.scale);
  if (!total) throw usage_error("every term has a weight of zero: nothing to train", "loss");
  terms.insert(terms.begin(), {"loss", total});
  return terms;
}

}  // namespace clerestory
