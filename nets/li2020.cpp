#include "nets/li2020.hpp"

#include <vector>

#include "host/error.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/unit_vector.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/pad.hpp"
#include "host/ops/tensor/reciprocal.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"

namespace clerestory {
namespace {

/// Bilinear between pixels' centres.
Value resized(Value x, int height, int width) { return resize_bilinear(x, height, width, Aligned::Centres); }

/// Convolution `conv<name>`, group normalisation `gn<name>`, ReLU; `prefix` comes before both.
Value step(const Scope& scope, const std::string& prefix, const std::string& name, Value x, int channels, int kernel,
           int stride, int pad) {
  const Value y = conv_bias_layer(scope / (prefix + "conv" + name), x, channels, kernel, stride, pad);
  return group_norm_relu_layer(scope / (prefix + "gn" + name), y, channels / kLi2020Group);
}

/// Half the size; the first of an encoder pads by replication, others by zeros.
Value halved(const Scope& scope, const std::string& name, Value x, int channels, bool first) {
  return step(scope, "", name, first ? pad_replicate(x, {1, 1, 1, 1}) : x, channels, 4, 2, first ? 0 : 1);
}

/// Features at 1/2, 1/4, ... 1/32 of x, and the last again at the same size.
std::vector<Value> encoder(const Scope& scope, Value x, const std::array<int, 6>& channels) {
  std::vector<Value> levels;
  for (std::size_t i = 0; i < 5; ++i) {
    x = halved(scope, std::to_string(i + 1), x, channels[i], i == 0);
    levels.push_back(x);
  }
  levels.push_back(step(scope, "", "6", x, channels[5], 3, 1, 1));
  return levels;
}

/// From the deepest level up, beside each larger one, to `out` channels of height x width.
Value decoder(const Scope& scope, const std::vector<Value>& levels, const std::array<int, 6>& channels, int out,
              int height, int width) {
  Value x = step(scope, "d", "1", levels[5], channels[0], 3, 1, 1);
  for (std::size_t i = 1; i < 6; ++i) {
    const Value skip = levels[5 - i];
    const Value both = concat(std::array{x, skip});
    x = step(scope, "d", std::to_string(i + 1), resized(both, 2 * both.shape().h, 2 * both.shape().w), channels[i], 3,
             1, 1);
    const bool last = i == 5;
    x = resized(x, last ? height : levels[4 - i].shape().h, last ? width : levels[4 - i].shape().w);
  }
  return conv_bias_layer(scope / "dconvFinal", pad_replicate(x, {1, 1, 1, 1}), out, 3, 1, 0);
}

void check_picture(const Value& image, int least, const char* net) {
  const Shape& s = image.shape();
  if (s.h < least || s.w < least)
    throw usage_error("a picture is too small for the net of Li et al.", net, fmt::format("{}x{}", s.w, s.h),
                      fmt::format("at least {0}x{0}", least));
}

/// [-1, 1] to [0, 1].
Value to_unit(Value x) { return affine(x, 0.5, 0.5); }

Value channel_mean(Value x) {
  const Shape& s = x.shape();
  return sum_to(x, {s.n, 1, s.h, s.w}, 1.0 / s.c);
}

/// x over three times its mean in each picture.
Value about_a_third(Value x) {
  const Shape& s = x.shape();
  const Value mean = sum_to(x, {s.n, 1, 1, 1}, 1.0 / static_cast<double>(s.item()));
  return multiply(x, reciprocal(affine(mean, 3, 1e-10)));
}

/// The K axes of each pixel, brought to length one.
Value unit_axes(Value x) {
  const Shape s = x.shape();
  return reshape(unit_vector(reshape(x, {s.n * s.c / 3, 3, s.h, s.w})), s);
}

}  // namespace

Li2020MapsSize li2020_maps_size(const std::string& preset) {
  if (preset == "paper") return {};
  if (preset == "compact") return {{32, 48, 80, 80, 176, 352}, {176, 80, 80, 48, 32, 32}};
  throw usage_error("the nets of Li et al. have no such preset", "preset", preset, "paper or compact");
}

Li2020LightSize li2020_light_size(const std::string& preset) {
  if (preset == "paper") return {};
  if (preset == "compact") return {{16, 32}, {48, 96, 96, 192, 192, 400}, {192, 192, 96, 96, 48, 48}, 12};
  throw usage_error("the nets of Li et al. have no such preset", "preset", preset, "paper or compact");
}

Li2020Maps li2020_maps(const Scope& scope, Value image, const Li2020MapsSize& size) {
  check_picture(image, 32, "maps");
  const std::vector<Value> levels = encoder(scope / "encoder", image, size.encoder);
  const auto said = [&](const char* name) {
    return decoder(scope / name, levels, size.decoder, 3, image.shape().h, image.shape().w);
  };
  const auto bounded = [&](const char* name) { return activate(said(name), Function::SignedUnit); };
  Li2020Maps maps;
  maps.albedo = to_unit(bounded("decoder_albedo"));
  maps.normal = unit_vector(bounded("decoder_normal"));
  maps.rough = channel_mean(bounded("decoder_material"));
  maps.depth = to_unit(channel_mean(bounded("decoder_depth")));
  maps.deepest = levels[5];
  return maps;
}

Li2020Lobes li2020_lobes(const Scope& scope, Value image, const Li2020Maps& maps, const Li2020LightSize& size) {
  check_picture(image, 64, "light");
  const Shape& s = image.shape();
  const Value seen = detach(concat(std::array{image, about_a_third(maps.albedo), to_unit(maps.normal),
                                              to_unit(maps.rough), about_a_third(maps.depth)}));
  const Scope entry = scope / "encoder";
  Value x = halved(entry, "01", resized(seen, 2 * s.h, 2 * s.w), size.entry[0], true);
  x = halved(entry, "02", x, size.entry[1], false);
  const std::vector<Value> levels = encoder(entry, x, size.encoder);
  const auto said = [&](const char* name, int channels) {
    return decoder(scope / name, levels, size.decoder, channels, li2020_cells(s.h), li2020_cells(s.w));
  };
  const auto in_unit = [&](const char* name, int channels) {
    return to_unit(activate(said(name, channels), Function::SignedUnit));
  };
  Li2020Lobes lobes;
  lobes.axis = unit_axes(activate(said("decoder_axis", 3 * size.lobes), Function::Tanh));
  lobes.sharpness = in_unit("decoder_sharpness", size.lobes);
  lobes.weight = in_unit("decoder_weight", 3 * size.lobes);
  return lobes;
}

Gaussians li2020_gaussians(const Li2020Lobes& lobes, Value normal) {
  const Shape& cells = lobes.axis.shape();
  return {turn_to_camera(lobes.axis, resize_area(normal, cells.h, cells.w)),
          activate(lobes.sharpness, Function::Tangent), activate(lobes.weight, Function::Tangent)};
}

}  // namespace clerestory
