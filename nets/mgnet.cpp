#include "nets/mgnet.hpp"

#include <cmath>

#include "host/error.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/gemm.hpp"
#include "host/ops/nn/unit_vector.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "nets/imagenet.hpp"

namespace clerestory {
namespace {

/// {n, 6, h, w}: the picture and, from 0 at a hundredth of white to 1, its logarithm.
Value with_logarithm(Value image) {
  constexpr double floor = 0.01;
  return concat(std::array{image, affine(activate(affine(image, 1, floor), Function::Log), -1 / std::log(floor), 1)});
}

/// Features of `image`, at about 1/2, 1/4, 1/8, 1/16 and less.
std::array<Value, 5> encoder_levels(const Scope& scope, Value image, Value six, const MgnetSize& size) {
  if (size.lite())
    return efficientnet(scope, affine(display_coded(image), 2, -1), std::get<EfficientnetSize>(size.encoder));
  const auto& dense = std::get<DensenetSize>(size.encoder);
  return densenet(scope, size.shared() ? six : dense.imagenet_input ? imagenet_input(image) : image, dense);
}

/// Beyond the papers: a layer on what the encoder's last features are in the mean.
Value log_scale_of(const Scope& scale, Value features) {
  const Value pooled = plane_mean(detach(features));
  const Value weight = scale.state("weight", {1, pooled.shape().c, 1, 1}, Init::constant(0));
  const Value bias = scale.state("bias", {1, 1, 1, 1}, Init::constant(1.5));  // e^1.5 = 4.5 m: a room
  return linear(pooled, weight, bias);
}

Maps maps_of_li2020(const Scope& net, Value image, const Li2020MapsSize& size) {
  const Li2020Maps theirs = li2020_maps(net, image, size);
  const Value roughness = affine(theirs.rough, 0.5, 0.5);
  const Value metallic = image.graph().fill(roughness.shape(), 0);
  return {theirs.albedo, concat(std::array{roughness, metallic}), theirs.normal, theirs.depth,
          log_scale_of(net / "scale", theirs.deepest)};
}

}  // namespace

MgnetSize mgnet_size(const std::string& preset) {
  constexpr SharedDecoderSize shared{128, 128, 96, 64, 32, 24};
  if (preset == "paper") return {DensenetSize{.growth = 32, .first = 64}, DecoderSize{512, 256, 128, 64, 64}};
  if (preset == "compact") return {DensenetSize{.growth = 16, .first = 32}, DecoderSize{128, 64, 32, 16, 16}};
  if (preset == "shared") return {DensenetSize{.growth = 16, .first = 32}, shared};
  if (preset == "lite") return {EfficientnetSize{}, shared};
  if (preset == "li2020_paper") return {li2020_maps_size("paper"), {}};
  if (preset == "li2020") return {li2020_maps_size("compact"), {}};
  throw usage_error("there is no such preset", "preset", preset,
                    "paper, compact, shared, lite, li2020_paper or li2020");
}

std::span<int> MgnetSize::steps() {
  if (li2020()) return std::get<Li2020MapsSize>(encoder).decoder;
  return std::visit([](auto& channels) { return std::span<int>(channels); }, decoder);
}

std::span<const int> MgnetSize::steps() const {
  if (li2020()) return std::get<Li2020MapsSize>(encoder).decoder;
  return std::visit([](const auto& channels) { return std::span<const int>(channels); }, decoder);
}

std::string MgnetSize::steps_wanted() const {
  const std::span<const int> channels = steps();
  bool divide = true;
  if (li2020()) {
    for (const int c : channels) divide = divide && c % kLi2020Group == 0;
    return divide ? std::string() : fmt::format("multiples of {}", kLi2020Group);
  }
  for (std::size_t i = 0; i < channels.size(); ++i)
    divide = divide && channels[i] % (shared() ? kSharedGroup : kDecoderGroups[i]) == 0;
  if (divide) return {};
  return "multiples of " +
         (shared() ? fmt::format("{}", kSharedGroup) : fmt::format("{}", fmt::join(kDecoderGroups, ", ")));
}

std::array<Value, 5> mgnet_encoder(const Scope& scope, Value image, const MgnetSize& size) {
  return encoder_levels(scope, image, size.shared() ? with_logarithm(image) : Value(), size);
}

Maps mgnet(Graph& graph, Value image, const MgnetSize& size, bool training) {
  const Scope net{graph, training, ""};
  if (size.li2020()) return maps_of_li2020(net, image, std::get<Li2020MapsSize>(size.encoder));
  const Value six = size.shared() ? with_logarithm(image) : Value();
  const std::array<Value, 5> levels = encoder_levels(net / "encoder", image, six, size);
  const int height = image.shape().h, width = image.shape().w;
  Value features;
  if (size.shared()) features = shared_decoder(net / "decoder", levels, std::get<SharedDecoderSize>(size.decoder), six);
  const auto head = [&](const std::string& name, int channels) {
    if (size.shared()) return map_head(net / name, features, channels);
    return decoder(net / name, levels, std::get<DecoderSize>(size.decoder), channels, height, width);
  };
  Maps maps;
  maps.albedo = activate(head("decoder_albedo", 3), Function::Unit);
  maps.material = activate(head("decoder_material", 2), Function::Unit);
  maps.normal = unit_vector(activate(head("decoder_normal", 3), Function::SignedUnit));
  const Value depth = head("decoder_depth", 3);
  maps.depth = activate(sum_to(depth, {depth.shape().n, 1, height, width}, 1.0 / 3), Function::Unit);
  maps.log_scale = log_scale_of(net / "scale", levels[4]);
  return maps;
}

}  // namespace clerestory
