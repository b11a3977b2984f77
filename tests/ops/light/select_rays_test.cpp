// Lists of rays against a plain loop: both parts, chunks, empty and full lists.
#include "host/ops/light/select_rays.hpp"

#include <gtest/gtest.h>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

struct Tile {
  int pixels, samples;  // inside the chunk
};

std::vector<Tensor> reference(const Tensors& t, LightPart part, double epsilon, Tile inside) {
  const Tensor& u = t.at("u");
  std::vector<int> list;
  for (int p = 0; p < u.shape.h; ++p)
    for (int s = 0; s < u.shape.w; ++s) {
      const int ray = p * u.shape.w + s;
      const double share = u.at(0, 0, p, s);
      bool wanted = p < inside.pixels && s < inside.samples;
      double length = 0;
      for (int c = 0; c < 3; ++c) length += std::abs(t.at("direction").at(0, c, p, s));
      wanted = wanted && length > 0;
      if (part == LightPart::InView)
        wanted = wanted && t.at("hit").integer[static_cast<std::size_t>(ray)] >= 0 && share < 1 - epsilon;
      else
        wanted = wanted && share > epsilon;
      if (wanted) list.push_back(ray);
    }
  const int count = static_cast<int>(list.size());
  list.resize(static_cast<std::size_t>(u.shape.plane()), -1);
  return {Tensor::of_int(u.shape, list), Tensor::of_int({1, 1, 1, 1}, {count})};
}

/// u is 0 for a tenth of the rays, 1 on misses, 1/4 and 3/4 for another tenth each, and for the others between 0.1 and
/// 0.9; a few have no direction.
Tensors rays_like_ssrt(int pixels, int samples) {
  const Shape one{1, 1, pixels, samples};
  Tensors t{{"u", random_tensor(one, 1, 0, 1)},
            {"hit", random_ints(one, 2, -3, 9)},
            {"direction", random_tensor({1, 3, pixels, samples}, 3)}};
  for (int p = 0; p < pixels; ++p)
    for (int s = 0; s < samples; ++s) {
      double& u = t["u"].at(0, 0, p, s);
      int& hit = t["hit"].integer[static_cast<std::size_t>(p * samples + s)];
      if (hit < 0) hit = -1;
      u = hit < 0 ? 1 : u < 0.1 ? 0 : u < 0.2 ? 0.25 : u < 0.3 ? 0.75 : 0.1 + 0.8 * u;
      if ((p * samples + s) % 13 == 5)
        for (int c = 0; c < 3; ++c) t["direction"].at(0, c, p, s) = 0;
      if ((p * samples + s) % 13 == 6)
        for (int c = 0; c < 2; ++c) t["direction"].at(0, c, p, s) = 0;  // along z: a ray
    }
  return t;
}

OpCase select_case(const std::string& label, Tensors inputs, LightPart part, double epsilon) {
  OpCase c{.stem = "select_rays", .label = label, .kernels = {"count_wanted", "begin_blocks", "place_wanted"}};
  c.inputs = std::move(inputs);
  c.build = [=](Graph&, const Values& v) {
    const RayList list = select_rays(v.at("u"), v.at("hit"), v.at("direction"), part, epsilon);
    return std::vector{list.rays, list.count};
  };
  c.reference = [=](const Tensors& t) { return reference(t, part, epsilon, {t.at("u").shape.h, t.at("u").shape.w}); };
  c.no_gradient = "the list is discrete";
  return c;
}

OP_CASES(select_rays) {
  Tensors certain = rays_like_ssrt(5, 16), none = rays_like_ssrt(5, 16), one = none;
  for (double& u : certain["u"].real) u = 0;
  for (double& d : none["direction"].real) d = 0;
  for (double& d : one["direction"].real) d = 0;
  one["direction"].at(0, 1, 4, 15) = -2, one["u"].at(0, 0, 4, 15) = 0.5;
  return {select_case("in_view", rays_like_ssrt(7, 48), LightPart::InView, 0),
          select_case("out_of_view", rays_like_ssrt(7, 48), LightPart::OutOfView, 0),
          select_case("with_a_share_left_out", rays_like_ssrt(7, 48), LightPart::InView, 0.25),
          select_case("many_blocks", rays_like_ssrt(4500, 16), LightPart::OutOfView, 0.25),
          select_case("all_certain", certain, LightPart::OutOfView, 0),
          select_case("no_rays", none, LightPart::InView, 0),
          select_case("one_ray", one, LightPart::OutOfView, 0)};
}

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
