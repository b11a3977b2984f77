// A generated room as studies use it: its first view, and what the tracer sees there.
#pragma once
#include "experiments/truth/room_list.hpp"
#include "nets/scene.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// A view's true maps, without rounding, as a scene; its photograph is left empty.
Scene scene_of(const TraceMaps& maps, const Camera& camera);

/// Of a view: its pixels that have a depth, row-major.
std::vector<bool> pixels_with_depth(const Scene& scene);

/// Stream of a listed room's seed that its photograph is traced with.
inline constexpr std::uint64_t kPhotographSeed = 1;

struct TracedRoom {
  TracedRoom(const Device& device, const ListedRoom& listed, int width, int height)
      : room(listed.make()),
        traced(device, room.scene),
        camera(listed.cameras(traced, room, 1, width, height).at(0)),
        maps(traced.maps(camera)),
        scene(scene_of(maps, camera)) {}
  /// Gives the scene its photograph: the picture traced with `spp` samples, 95th percentile of luminance at 0.9.
  void take_photograph(int spp, std::uint32_t seed);
  Room room;
  TraceScene traced;
  Camera camera;
  TraceMaps maps;
  Scene scene;  // true maps; without a photograph
};

}  // namespace clerestory
