// Lists of rays by a plain loop.
#pragma once
#include "checks/op_case.hpp"
#include "host/ops/light/select_rays.hpp"

namespace clerestory::select_rays_reference {

struct Tile {
  int pixels, samples;  // inside the chunk
};

inline std::vector<Tensor> reference(const Tensors& t, LightPart part, double epsilon, Tile inside) {
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
inline Tensors rays_like_ssrt(int pixels, int samples) {
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

}  // namespace clerestory::select_rays_reference
