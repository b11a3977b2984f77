// A generated room as studies use it: its first view, and what the tracer sees there.
#pragma once
#include "experiments/studies/truth_study.hpp"
#include "tracer/views.hpp"

namespace clerestory {

struct TracedRoom {
  TracedRoom(const Device& device, const RoomAssets& assets, std::uint64_t seed, int width, int height)
      : room(make_room(seed, Setting::Training, assets)),
        traced(device, room.scene),
        camera(choose_views(traced, room, 1, width, height, Random(seed).fork(100)).at(0)),
        maps(traced.maps(camera)),
        scene(scene_of(maps, camera)) {}
  Room room;
  TraceScene traced;
  Camera camera;
  TraceMaps maps;
  Scene scene;  // true maps; without a photograph
};

}  // namespace clerestory
