// The picture that speeds are measured on, whose content does not change: a furnished box room in metres.
#pragma once
#include "host/graph/tensor.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

struct BenchRoom {
  Camera camera;         // 65 degrees across
  Tensor depth, normal;  // {1, 1, h, w} metres, {1, 3, h, w} camera frame
};
BenchRoom bench_room(int width, int height);

}  // namespace clerestory
