// A small scene for tests of the layer, and lights for it that need no network.
#pragma once
#include "checks/op_case.hpp"
#include "host/math/camera.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/shade/render.hpp"

namespace clerestory {

/// A wall 2 m before the camera whose right half stands forward; the left half is turned to the right, so that some of
/// its rays end on the right half.
inline Tensors wall(int w, int h, double roughness, double metallic, int n = 1) {
  Tensors t{{"depth", Tensor(Shape{n, 1, h, w}, 2)},
            {"normal", Tensor(Shape{n, 3, h, w})},
            {"albedo", random_tensor({n, 3, h, w}, 1, 0.2, 0.9)},
            {"material", Tensor(Shape{n, 2, h, w})},
            {"ambient", random_tensor({n, 3, 1, 1}, 2, 0.5, 1)},
            {"image", random_tensor({n, 3, h, w}, 3, 0, 2)}};
  for (int k = 0; k < n; ++k)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        t["normal"].at(k, 0, y, x) = x > w / 2 ? 0 : 0.6;
        t["normal"].at(k, 2, y, x) = x > w / 2 ? 1 : 0.8;
        t["material"].at(k, 0, y, x) = roughness;
        t["material"].at(k, 1, y, x) = metallic;
        if (x > w / 2) t["depth"].at(k, 0, y, x) = 1.5;
      }
  t["camera"] = camera_tensor(std::vector<Camera>(static_cast<std::size_t>(n), Camera::from_fov(w, h, 70.0)));
  t["range"] = depth_range(t["depth"]);
  return t;
}

/// A lamp for directions to be drawn towards: {1, 5, 1, 1} of light_guide().
inline Tensor lamp_of_wall() { return Tensor({1, 5, 1, 1}, std::vector<double>{0.3, 0, -1.6, 0.2, 20}); }

/// Its inputs: image, ambient.
inline Value image_answers(Graph&, const RayBatch& rays, std::span<const Value> in) {
  return image_light(in[0], in[1], rays.hits.pixel);
}
/// Its input: ambient.
inline Value constant_answers(Graph&, const RayBatch& rays, std::span<const Value> in) {
  return constant_light(in[0], rays.direction, rays.maps.depth);
}
/// Its inputs: image, ambient.
inline Value panorama_answers(Graph&, const RayBatch& rays, std::span<const Value> in) {
  return panorama_light(in[0], in[1], rays.camera, rays.direction);
}

}  // namespace clerestory
