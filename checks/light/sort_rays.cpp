// The order of rays by the pixels that they hit, against std::stable_sort.
#include "host/ops/light/sort_rays.hpp"

#include "checks/light/sort_rays_reference.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace sort_rays_reference;

OpCase sort_case(const std::string& label, const Shape& map, int rows, int samples, int low, int high) {
  OpCase c{.stem = "sort_rays", .label = label};
  c.kernels = {"ray_keys", "count_digits", "begin_digits", "place_by_digit", "segment_starts"};
  c.inputs = {{"hit", random_ints({1, 1, rows, samples}, 3, low, high)}};
  c.build = [map](Graph&, const Values& v) {
    const SortedRays s = sort_rays(v.at("hit"), map);
    return std::vector{s.order, s.starts};
  };
  c.reference = [map](const Tensors& t) { return sorted_reference(t.at("hit"), map); };
  c.no_gradient = "integers";
  return c;
}

OP_CASES(sort_rays) {
  return {sort_case("one_digit", {1, 3, 4, 6}, 24, 16, -2, 24),  //
          sort_case("two_digits_and_blocks", {2, 1, 20, 16}, 640, 16, -20, 320),
          sort_case("three_digits", {1, 1, 260, 256}, 300, 16, -100, 66560),
          sort_case("all_misses", {1, 1, 4, 6}, 24, 16, -1, 0),  //
          sort_case("one_pixel", {1, 1, 20, 16}, 320, 16, 319, 320)};
}

}  // namespace
}  // namespace clerestory
