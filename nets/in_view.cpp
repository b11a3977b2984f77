#include "nets/in_view.hpp"

#include <cmath>
#include <tuple>

#include "host/error.hpp"
#include "host/ops/light/ask_mlp.hpp"
#include "host/ops/light/direction_grid.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/pixel_rows.hpp"
#include "host/ops/light/ray_mlp.hpp"
#include "host/ops/light/rescale_hits.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"
#include "nets/imagenet.hpp"

namespace clerestory {
namespace {

/// The parts of the MLP's input, and how many numbers each has.
struct InputSizes {
  int features = 0, surface = 0, direction = 0;
  int all() const { return features + surface + direction; }
};

InputSizes input_sizes(const InViewSize& size) {
  InputSizes sizes;
  sizes.features = size.trunk.channels[0];
  for (std::size_t stage = 0; stage < static_cast<std::size_t>(size.trunk.stages); ++stage)
    sizes.features += size.trunk.channels[stage];
  sizes.surface = 4 * 2 * size.frequencies;  // normal, diffuse and specular colour, roughness
  sizes.direction = 2 * size.frequencies;
  return sizes;
}

/// Layers that read the input: the first, and perhaps one more.
std::vector<int> reading_layers(const InViewSize& size) {
  return size.again > 0 ? std::vector{0, size.again} : std::vector{0};
}

int fan_in(const InViewSize& size, int layer) {
  const int input = input_sizes(size).all();
  return layer == 0 ? input : size.width + (layer == size.again ? input : 0);
}

/// One part of a layer's weights, which reads `channels` numbers.
Value weight_of(const Scope& scope, const InViewSize& size, int layer, const char* name, int channels) {
  const Init init = Init::normal(std::sqrt(2.0 / fan_in(size, layer)));
  return (scope / fmt::format("mlp.{}.{}", layer, name)).state("weight", {size.width, channels, 1, 1}, init);
}

/// It as a convolution with one tap.
Value part(const Scope& scope, const InViewSize& size, int layer, const char* name, Value x) {
  return conv(x, weight_of(scope, size, layer, name, x.shape().c), {});
}

bool reads_input(const InViewSize& size, int layer) { return layer == 0 || (size.again > 0 && layer == size.again); }

Value bias_of(const Scope& scope, int layer, int channels) {
  return (scope / fmt::format("mlp.{}", layer)).state("bias", {1, channels, 1, 1}, Init::constant(0));
}

Value frequencies_of(const Scope& scope, const char* name, int channels, int frequencies, double deviation) {
  const Init drawn{Init::Kind::Normal, deviation, false};
  return (scope / "frequencies").state(name, {frequencies, channels, 1, 1}, drawn);
}

Value fourier(const Scope& scope, const char* name, Value x, int frequencies, double deviation) {
  return encode(x, frequencies_of(scope, name, x.shape().c, frequencies, deviation));
}

/// The last layer's weight and bias.
std::pair<Value, Value> output_layer(const Scope& scope, const InViewSize& size) {
  const double deviation = size.output == LightOutput::Residual ? 0.01 : std::sqrt(2.0 / size.width);
  const Scope out = scope / "mlp.out";
  return {out.state("weight", {3, size.width, 1, 1}, Init::normal(deviation)),
          out.state("bias", {1, 3, 1, 1}, Init::constant(0))};
}

/// What every reading layer owes to x, side by side.
Value per_pixel(const Scope& scope, const InViewSize& size, const char* name, Value x) {
  std::vector<Value> parts;
  for (const int layer : reading_layers(size)) parts.push_back(part(scope, size, layer, name, x));
  return parts.size() == 1 ? parts[0] : concat(parts);
}

Value features_of(const Scope& scope, Value image, const InViewSize& size) {
  const Value plain = size.log_input ? activate(image, Function::Log1p) : image;
  const Value seen = size.trunk.imagenet_input ? imagenet_input(image) : plain;
  std::vector<Value> levels = resnet(scope / "encoder", seen, size.trunk);
  const Shape& finest = levels[0].shape();
  for (std::size_t i = 1; i < levels.size(); ++i) levels[i] = resize_bilinear(levels[i], finest.h, finest.w);
  return concat(levels);
}

/// What is encoded of surfaces, side by side: normal, diffuse and specular colour, roughness.
Value surface_numbers(const Surfaces& s) {
  const Value roughness = slice(s.material, 0, 1), metallic = slice(s.material, 1, 1);
  const Value tinted = multiply(s.albedo, metallic);
  const Value diffuse = subtract(s.albedo, tinted);
  const Value specular = add(tinted, affine(expand(metallic, s.albedo.shape()), -0.04, 0.04));
  return concat(std::array{s.normal, diffuse, specular, roughness});
}

/// Of a map, or of what rays hit.
Value encoded_surfaces(const Scope& scope, Value numbers, const InViewSize& size) {
  const auto encoded = [&](const char* name, int first, int count) {
    return fourier(scope, name, slice(numbers, first, count), size.frequencies, size.surface_deviation);
  };
  return concat(std::array{encoded("normal", 0, 3), encoded("diffuse", 3, 3), encoded("specular", 6, 3),
                           encoded("roughness", 9, 1)});
}

Value radiance_of(Value f, Value hit, Value photo, LightOutput output) {
  constexpr double most = 100, most_exponent = 7;  // e^7: a thousand times white
  const auto below = [](Value x, double limit) { return affine(relu(affine(x, -1, limit)), -1, limit); };
  switch (output) {
    case LightOutput::Released:
      return below(relu(f), most);
    case LightOutput::Softplus:
      return activate(f, Function::Softplus);
    case LightOutput::Exp:
      return activate(below(affine(f, 1, -5), most_exponent), Function::Exp);
    case LightOutput::Residual:
      return multiply(gather_rays(photo, hit), activate(below(f, most_exponent), Function::Exp));
  }
  return {};
}

}  // namespace

LightOutput light_output_of(const std::string& name) {
  if (name == "released") return LightOutput::Released;
  if (name == "softplus") return LightOutput::Softplus;
  if (name == "exp") return LightOutput::Exp;
  if (name == "residual") return LightOutput::Residual;
  throw usage_error("there is no such output of the light", "light.output", name, "released, softplus, exp, residual");
}

int encoded_numbers(const InViewSize& size) {
  const InputSizes sizes = input_sizes(size);
  return sizes.surface + sizes.direction;
}

InViewSize in_view_size(const std::string& preset) {
  if (preset == "paper") return {.output = LightOutput::Released, .log_input = false};
  if (preset == "compact")
    return {.trunk = {.channels = {32, 64, 128, 256}, .stages = 3},
            .frequencies = 32,
            .width = 128,
            .layers = 4,
            .again = 0};
  throw usage_error("there is no such preset", "preset", preset, "paper or compact");
}

Value item_of(Value batch, int i) {
  const Shape& s = batch.shape();
  return slice(reshape(batch, {1, s.n * s.c, s.h, s.w}), i * s.c, s.c);
}

std::vector<Value> items_of(Value batch) {
  const Shape s = batch.shape();
  const Value flat = reshape(batch, {1, s.n * s.c, s.h, s.w});
  std::vector<Value> items;
  for (int i = 0; i < s.n; ++i) items.push_back(slice(flat, i * s.c, s.c));
  return items;
}

std::vector<LightPixels> light_pixels_of_batch(const Scope& scope, Value image, const Surfaces& surfaces,
                                               const InViewSize& size) {
  const Value features = per_pixel(scope, size, "features", features_of(scope, image, size));
  const Value numbers = surface_numbers(surfaces);
  const Value surface =
      scope.training ? Value{} : per_pixel(scope, size, "surface", encoded_surfaces(scope, numbers, size));
  const std::vector<Value> own = items_of(features), rest = items_of(scope.training ? numbers : surface);
  std::vector<LightPixels> pixels;
  for (std::size_t i = 0; i < own.size(); ++i)
    pixels.push_back(scope.training ? LightPixels{own[i], {}, rest[i]} : LightPixels{own[i], rest[i], {}});
  return pixels;
}

LightPixels light_pixels(const Scope& scope, Value image, const Surfaces& surfaces, const InViewSize& size) {
  return light_pixels_of_batch(scope, image, surfaces, size)[0];
}

namespace {

/// Its layers that read the input multiply what is encoded of directions and, with `surfaces`, of surfaces behind it.
LightMlp mlp_of(const Scope& scope, const InViewSize& size, bool surfaces) {
  const InputSizes sizes = input_sizes(size);
  LightMlp mlp;
  mlp.again = size.again;
  for (int layer = 0; layer < size.layers; ++layer) {
    if (layer > 0) mlp.hidden.push_back(weight_of(scope, size, layer, "hidden", size.width));
    if (reads_input(size, layer)) {
      const Value direction = weight_of(scope, size, layer, "direction", sizes.direction);
      mlp.direction.push_back(
          surfaces ? concat(std::array{direction, weight_of(scope, size, layer, "surface", sizes.surface)})
                   : direction);
    }
    mlp.biases.push_back(bias_of(scope, layer, size.width));
  }
  std::tie(mlp.out, mlp.out_bias) = output_layer(scope, size);
  return mlp;
}

Value direction_frequencies(const Scope& scope, const InViewSize& size) {
  return frequencies_of(scope, "direction", 3, size.frequencies, size.direction_deviation);
}

}  // namespace

Value in_view_light(const Scope& scope, const LightPixels& pixels, Value hit, Value direction, Value photo,
                    const InViewSize& size) {
  const Shape &cells = pixels.features.shape(), &picture = (pixels.surface ? pixels.surface : pixels.numbers).shape();
  const Value pixel = rescale_hits(hit, photo.shape(), picture);
  Value looked_up = gather_rays(pixels.features, rescale_hits(pixel, picture, cells));
  Value encoded = encode(direction, direction_frequencies(scope, size));
  if (pixels.surface)
    looked_up = add(gather_rays(pixels.surface, pixel), looked_up);
  else
    encoded = concat(std::array{encoded, encoded_surfaces(scope, gather_rays(pixels.numbers, pixel), size)});
  const LightMlp mlp = mlp_of(scope, size, !pixels.surface);
  return radiance_of(ray_mlp(mlp, looked_up, encoded), hit, photo, size.output);
}

InViewAnswers in_view_answers(const Scope& scope, const LightPixels& pixels, const InViewSize& size, Value normal) {
  InViewAnswers answers{pixel_rows(pixels.surface, pixels.features), pixels.surface.shape(), {}, normal};
  if (normal) {
    const GridRays rays = grid_directions(normal, kGridSide);
    answers.grid = ask_mlp(mlp_of(scope, size, false), direction_frequencies(scope, size), answers.rows, rays.pixel,
                           rays.direction, {});
  }
  return answers;
}

Value ask_in_view_light(const Scope& scope, const InViewAnswers& answers, Value hit, Value direction, Value photo,
                        const RayList& list, const InViewSize& size) {
  const Value pixel = rescale_hits(hit, photo.shape(), answers.picture);
  const Value f = answers.grid ? look_up_grid(answers.grid, answers.normal, pixel, direction, list)
                               : ask_mlp(mlp_of(scope, size, false), direction_frequencies(scope, size), answers.rows,
                                         pixel, direction, list);
  return radiance_of(f, hit, photo, size.output);
}

}  // namespace clerestory
