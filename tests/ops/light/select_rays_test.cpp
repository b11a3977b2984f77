// Lists of rays of chunks, and what is refused.
#include "host/ops/light/select_rays.hpp"

#include <gtest/gtest.h>

#include "checks/light/select_rays_reference.hpp"
#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using namespace select_rays_reference;

TEST(SelectRays, RaysBeyondTheChunkAreLeftOut) {
  const Tensors inputs = rays_like_ssrt(6, 32);
  Graph g;
  const Value u = g.input("u", inputs.at("u").shape), hit = g.input("hit", inputs.at("hit").shape, Type::Int),
              direction = g.input("direction", inputs.at("direction").shape);
  const RayList list = select_rays(u, hit, direction, LightPart::OutOfView, 0);
  Executor executor(compile(g, {list.rays, list.count}, test_device()));
  for (const auto& [name, tensor] : inputs) executor.feed(name, tensor);
  executor.run(0, {100, 4, 64, 19});
  const std::vector<Tensor> want = reference(inputs, LightPart::OutOfView, 0, {4, 19});
  EXPECT_EQ(executor.fetch(list.rays).integer, want[0].integer);
  EXPECT_EQ(executor.fetch(list.count).integer, want[1].integer);
  EXPECT_GT(want[1].integer[0], 0);
}

TEST(SelectRays, ArgumentsAreChecked) {
  Graph g;
  const Value u = g.input("u", {1, 1, 2, 16}), hit = g.input("hit", {1, 1, 2, 16}, Type::Int),
              direction = g.input("direction", {1, 3, 2, 16});
  EXPECT_THROW(select_rays(u, hit, direction, LightPart::InView, 1), Error);
  EXPECT_THROW(select_rays(u, hit, direction, LightPart::InView, -0.1), Error);
  EXPECT_THROW(select_rays(u, u, direction, LightPart::InView, 0), Error);
  EXPECT_THROW(select_rays(u, hit, g.input("other", {1, 3, 3, 16}), LightPart::InView, 0), Error);
}

}  // namespace
}  // namespace clerestory
