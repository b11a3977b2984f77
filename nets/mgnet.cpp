#include "nets/mgnet.hpp"

#include "host/error.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/gemm.hpp"
#include "host/ops/nn/unit_vector.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"

namespace clerestory {

MgnetSize mgnet_size(const std::string& preset) {
  if (preset == "paper") return {{.growth = 32, .first = 64}, {512, 256, 128, 64, 64}};
  if (preset == "compact") return {{.growth = 16, .first = 32}, {128, 64, 32, 16, 16}};
  throw usage_error("there is no such preset", "preset", preset, "paper or compact");
}

Maps mgnet(Graph& graph, Value image, const MgnetSize& size, bool training) {
  const Scope net{graph, training, ""};
  const std::array<Value, 5> levels = densenet(net / "encoder", image, size.encoder);
  const int height = image.shape().h, width = image.shape().w;
  const auto head = [&](const std::string& name, int channels) {
    return decoder(net / name, levels, size.decoder, channels, height, width);
  };
  Maps maps;
  maps.albedo = activate(head("decoder_albedo", 3), Function::Unit);
  maps.material = activate(head("decoder_material", 2), Function::Unit);
  maps.normal = unit_vector(activate(head("decoder_normal", 3), Function::SignedUnit));
  const Value depth = head("decoder_depth", 3);
  maps.depth = activate(sum_to(depth, {depth.shape().n, 1, height, width}, 1.0 / 3), Function::Unit);

  const Value pooled = plane_mean(detach(levels[4]));
  const Scope scale = net / "scale";
  const Value weight = scale.state("weight", {1, pooled.shape().c, 1, 1}, Init::constant(0));
  const Value bias = scale.state("bias", {1, 1, 1, 1}, Init::constant(1.5));  // e^1.5 = 4.5 m: a room
  maps.log_scale = linear(pooled, weight, bias);
  return maps;
}

}  // namespace clerestory
