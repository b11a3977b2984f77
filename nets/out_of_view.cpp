#include "nets/out_of_view.hpp"

#include <cmath>
#include <numbers>

#include "host/error.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/slice.hpp"
#include "nets/imagenet.hpp"
#include "nets/in_view.hpp"

namespace clerestory {
namespace {

/// Widths of the field from its input to density and colour.
std::vector<int> field_widths(const OutOfViewSize& size) {
  std::vector<int> widths{3 + 6 * size.octaves};
  widths.insert(widths.end(), size.hidden.begin(), size.hidden.end());
  widths.push_back(4);
  return widths;
}

Value dense(const Scope& scope, Value x, int out) { return conv_bias_layer(scope, x, out, 1, 1, 0); }

Value leaky_relu(Value x) {
  constexpr double slope = 0.1;
  return add(relu(x), relu(scale(x, -1)), -slope);
}

Value stem(const Scope& scope, Value code, const OutOfViewSize& size) {
  return relu(dense(scope / "stem.1", relu(dense(scope / "stem.0", code, size.stem)), size.stem));
}

/// Numbers {n, count, 1, 1} for one layer of the field, as the released hypernetwork makes them.
Value written(const Scope& scope, Value x, int count, const OutOfViewSize& size) {
  const Value hidden = relu(dense(scope / "1", relu(dense(scope / "0", x, size.inner)), size.inner));
  return leaky_relu(dense(scope / "2", hidden, count));
}

std::vector<LightField> paper_fields(const Scope& scope, Value code, const OutOfViewSize& size) {
  const std::vector<int> widths = field_widths(size);
  const Value for_weights = stem(scope / "weights", code, size), for_biases = stem(scope / "biases", code, size);
  std::vector<LightField> fields(static_cast<std::size_t>(code.shape().n));
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const int in = widths[i], out = widths[i + 1];
    const auto weights = items_of(written(scope / fmt::format("weights.{}", i), for_weights, out * in, size));
    const auto biases = items_of(written(scope / fmt::format("biases.{}", i), for_biases, out, size));
    for (std::size_t n = 0; n < fields.size(); ++n) {
      fields[n].weights.push_back(reshape(weights[n], {out, in, 1, 1}));
      fields[n].biases.push_back(biases[n]);
    }
  }
  return fields;
}

std::vector<LightField> low_rank_fields(const Scope& scope, Value code, const OutOfViewSize& size) {
  const std::vector<int> widths = field_widths(size);
  const Value x = stem(scope, code, size);
  std::vector<LightField> fields(static_cast<std::size_t>(code.shape().n));
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const int in = widths[i], out = widths[i + 1], thin = size.rank * (in + out);
    const Scope layer = scope / fmt::format("layer{}", i);
    const double deviation = std::sqrt(2.0 / in);
    const Value base = layer.state("weight", {out, in, 1, 1}, Init::normal(deviation));
    const Value base_bias = layer.state("bias", {1, out, 1, 1}, Init::constant(0));
    const std::vector<Value> numbers = items_of(dense(layer / "written", x, thin + out));
    for (std::size_t n = 0; n < fields.size(); ++n) {
      LightField& field = fields[n];
      const Value own = numbers[n];
      const Value tall = reshape(slice(own, 0, size.rank * out), {out, size.rank, 1, 1});
      const Value wide = reshape(slice(own, size.rank * out, size.rank * in), {1, size.rank, in, 1});
      // The product of the thin matrices as a convolution over `in` pixels.
      const Value product = reshape(conv(wide, tall, {}), {out, in, 1, 1});
      field.weights.push_back(add(base, product, deviation / std::sqrt(size.rank)));
      field.biases.push_back(add(base_bias, slice(own, thin, out)));
    }
  }
  return fields;
}

/// [x, sin(2^k x), cos(2^k x)], k below `octaves`.
Value encoded(Value position, int octaves) {
  Tensor frequencies = octave_frequencies(3, octaves);
  for (double& f : frequencies.real) f /= std::numbers::pi;  // its first is half a cycle a unit
  return concat(std::array{position, encode(position, position.graph().constant(frequencies))});
}

/// The photograph and perhaps the maps, depth in scales.
Value trunk_input(const LightInputs& p, const OutOfViewSize& size) {
  const Value plain = size.log_input ? activate(p.image, Function::Log1p) : p.image;
  const Value seen = size.trunk.imagenet_input ? imagenet_input(p.image) : plain;
  if (!size.sees_maps) return seen;
  const Value unit = activate(scale(activate(slice(p.range, 0, 1), Function::Log), -1), Function::Exp);
  return concat(std::array{seen, p.surfaces.albedo, p.surfaces.normal, p.surfaces.material, multiply(p.depth, unit)});
}

}  // namespace

OutOfViewSize out_of_view_size(const std::string& preset) {
  if (preset == "paper") return {};
  if (preset == "compact")
    return {.trunk = {.channels = {32, 64, 128, 256}},
            .hyper = HyperNet::LowRank,
            .stem = 256,
            .hidden = {32, 32},
            .march = {.segments = 32},
            .released_output = false,
            .log_input = true};
  throw usage_error("there is no such preset", "preset", preset, "paper or compact");
}

OutOfViewForm out_of_view_form(const std::string& name) {
  if (name == "field") return OutOfViewForm::Field;
  if (name == "shells") return OutOfViewForm::Shells;
  throw usage_error("there is no such form", "light.out_of_view", name, "field or shells");
}

Value with_gain(Value light, const OutOfViewSize& size) { return size.gain == 1 ? light : scale(light, size.gain); }

std::vector<LightField> light_fields(const Scope& scope, const LightInputs& pictures, const OutOfViewSize& size) {
  const std::vector<Value> levels = resnet(scope / "encoder", trunk_input(pictures, size), size.trunk);
  if (size.form == OutOfViewForm::Shells) {
    std::vector<LightField> fields;
    for (const Value shells : light_shells(scope / "shells", levels, pictures.image, pictures.camera, size.shells))
      fields.push_back({{}, {}, shells, {}});
    return fields;
  }
  const Value code = plane_mean(levels.back());
  const Scope hyper = scope / "hyper";
  std::vector<LightField> fields =
      size.hyper == HyperNet::Paper ? paper_fields(hyper, code, size) : low_rank_fields(hyper, code, size);
  if (size.background) {
    const auto colours = items_of(activate(dense(hyper / "background", code, 3), Function::Softplus));
    for (std::size_t n = 0; n < fields.size(); ++n) fields[n].background = colours[n];
  }
  return fields;
}

namespace {

Value field_light(const LightField& field, Value points, Value direction, Value range, const OutOfViewSize& size) {
  if (field.shells) return shells_light(field.shells, points, direction, range, size.shells);
  const Marched samples = march(points, direction, range, points.shape(), size.march);
  Value x = encoded(samples.position, size.octaves);
  for (std::size_t i = 0; i < field.weights.size(); ++i) {
    x = conv(x, field.weights[i], field.biases[i]);
    if (i + 1 < field.weights.size() || size.released_output) x = relu(x);
  }
  if (!size.released_output) x = activate(x, Function::Softplus);
  const Composited seen = composite(slice(x, 3, 1), slice(x, 0, 3), samples.length);
  if (!field.background) return seen.radiance;
  return add(seen.radiance, conv(seen.transmittance, reshape(field.background, {3, 1, 1, 1}), {}));
}

}  // namespace

Value out_of_view_light(const LightField& field, Value points, Value direction, Value range,
                        const OutOfViewSize& size) {
  return with_gain(field_light(field, points, direction, range, size), size);
}

}  // namespace clerestory
