// Lists of rays against a plain loop: both parts, empty and full lists.
#include "host/ops/light/select_rays.hpp"

#include "checks/light/select_rays_reference.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace select_rays_reference;

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
          select_case("every_ray_in_view", rays_like_ssrt(7, 48), LightPart::InView, kEveryRay),
          select_case("every_ray_out_of_view", rays_like_ssrt(7, 48), LightPart::OutOfView, kEveryRay),
          select_case("many_blocks", rays_like_ssrt(4500, 16), LightPart::OutOfView, 0.25),
          select_case("all_certain", certain, LightPart::OutOfView, 0),
          select_case("no_rays", none, LightPart::InView, 0),
          select_case("one_ray", one, LightPart::OutOfView, 0)};
}

}  // namespace
}  // namespace clerestory
