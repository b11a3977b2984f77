#include "nets/li2020_light.hpp"

#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/shade/sample_brdf.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reciprocal.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr int kDirections = 128;

/// At least `floor`.
Value at_least(Value x, double floor) { return affine(relu(affine(x, 1, -floor)), 1, floor); }

/// 1 where x > floor, 0 where it is not: no number lies between.
Value above(Value x, double floor) { return clamp_to_unit(affine(affine(x, 1, -floor), 1e30)); }

Value total(Value a, Value b) { return sum_to(multiply(a, b), {1, 1, 1, 1}); }

Value over(Value a, Value b) { return multiply(a, reciprocal(b)); }

Value cells_of(Value map) { return resize_area(map, li2020_cells(map.shape().h), li2020_cells(map.shape().w)); }

/// The camera of the grid of cells.
Value cell_camera(Value camera, const Shape& picture) {
  const double across = static_cast<double>(li2020_cells(picture.w)) / picture.w,
               down = static_cast<double>(li2020_cells(picture.h)) / picture.h;
  return multiply(camera,
                  camera.graph().constant(Tensor({1, 4, 1, 1}, std::vector<double>{across, down, across, down})));
}

/// Lobes {1, ., h, w} as those of rows of rays.
Gaussians rows_of(const Gaussians& maps) {
  const auto rows = [](Value map) {
    const Shape& s = map.shape();
    return reshape(map, {1, s.c, s.h * s.w, 1});
  };
  return {rows(maps.axis), rows(maps.sharpness), rows(maps.weight)};
}

}  // namespace

Gaussians li2020_light(const Scope& scope, const LightInputs& p, const Li2020LightSize& size) {
  const Value rough = affine(slice(p.surfaces.material, 0, 1), 2, -1);
  const Li2020Lobes lobes =
      li2020_lobes(scope, clamp_to_unit(p.image), {p.surfaces.albedo, p.surfaces.normal, rough, p.depth, {}}, size);
  return li2020_gaussians(lobes, p.surfaces.normal);
}

Li2020Shaded li2020_shaded(const Gaussians& lobes, const LightInputs& p) {
  const Surfaces surfaces{cells_of(p.surfaces.albedo), cells_of(p.surfaces.normal), cells_of(p.surfaces.material)};
  const Shape cells = surfaces.albedo.shape();
  const Value depth = resize_nearest(p.depth, cells.h, cells.w);
  const BrdfSamples drawn =
      sample_brdf(depth, cell_camera(p.camera, p.image.shape()), surfaces, surfaces, cells.h * cells.w, kDirections,
                  {.sampler = Sampler::Grid8x16, .brdf = BrdfModel::Li2020, .lobes = true});
  const Value light = spherical_gaussians(rows_of(lobes), drawn.direction);
  const auto reflected = [&](Value weight) {
    return reshape(accumulate_samples(weight, light, drawn.pdf, {}, {}, kDirections).mean, cells);
  };
  const Value specular = multiply(drawn.weight, drawn.lobes.specular);
  return {reflected(subtract(drawn.weight, specular)), reflected(specular)};
}

Value li2020_lit_cells(const LightInputs& p) {
  const Value known = above(p.depth, 0);
  return cells_of(multiply(known, affine(slice(p.surfaces.material, 2, 1), -1, 1)));
}

Value li2020_seen_cells(const LightInputs& p) { return cells_of(clamp_to_unit(p.image)); }

Value li2020_shown(const Li2020Shaded& shaded) { return clamp_to_unit(add(shaded.diffuse, shaded.specular)); }

Gaussians li2020_as_bright(const Gaussians& lobes, const LightInputs& p) {
  const Li2020Shaded shaded = li2020_shaded(lobes, p);
  const Value both = add(shaded.diffuse, shaded.specular), seen = li2020_seen_cells(p), mask = li2020_lit_cells(p);
  const Value first = least_squares_scale(both, seen, mask);
  const Value second = least_squares_scale(clamp_to_unit(multiply(both, first)), seen, mask);
  return {lobes.axis, lobes.sharpness, multiply(lobes.weight, multiply(first, second))};
}

Li2020Shaded li2020_rescaled(const Li2020Shaded& shaded, Value image) {
  const Value dark = affine(above(image, 0.9), -1, 1);
  const Value diffuse = multiply(detach(shaded.diffuse), dark), specular = multiply(detach(shaded.specular), dark),
              seen = multiply(image, dark);
  const Value dd = total(diffuse, diffuse), ss = total(specular, specular), ds = total(diffuse, specular),
              dy = total(diffuse, seen), sy = total(specular, seen);
  const Value determinant = subtract(multiply(dd, ss), multiply(ds, ds));
  const Value told_apart = above(scale(determinant, 1.0 / static_cast<double>(image.shape().item())), 0.01),
              not_apart = affine(told_apart, -1, 1), divisor = at_least(determinant, 1e-2);
  const auto within = [](Value x) { return affine(relu(affine(relu(x), -1, 1000)), -1, 1000); };  // [0, 1000]
  const Value alone = at_least(over(dy, at_least(dd, 1e-5)), 1e-3);
  const Value of_both = over(subtract(multiply(dy, ss), multiply(sy, ds)), divisor);
  const Value of_diffuse = within(add(multiply(told_apart, of_both), multiply(not_apart, alone)));
  const Value of_specular = within(multiply(told_apart, over(subtract(multiply(sy, dd), multiply(dy, ds)), divisor)));
  const Li2020Shaded scaled{multiply(shaded.diffuse, of_diffuse), multiply(shaded.specular, of_specular)};
  const Value again = least_squares_scale(detach(li2020_shown(scaled)), image,
                                          image.graph().fill({1, 1, image.shape().h, image.shape().w}, 1));
  return {multiply(scaled.diffuse, again), multiply(scaled.specular, again)};
}

}  // namespace clerestory
