// The Monte Carlo layer on a scene with objects in it, compiled once: what their pixels show, and what they change on
// all others.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "experiments/applications/insert.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/shade/render.hpp"

namespace clerestory {

class ObjectsLayer {
 public:
  ObjectsLayer(Device& device, const Scene& scene, std::shared_ptr<TraceObjects> objects,
               const std::vector<InsertedObject>& list, const RenderSettings& settings, int bounces);

  /// Radiance of pixels that show an object; of all others the difference that objects make. `with`: put_before() of
  /// the scene as any camera sees it that sees through the same pixels.
  Image radiance(const SceneWithObjects& with, std::uint32_t seed);

  double seconds() const { return seconds_; }  // of all renders, after the plan was made
  double dropped() const { return dropped_; }  // samples of all renders that were not finite

 private:
  Device& device_;
  Graph graph_;
  Rendered rendered_;
  std::optional<Executor> executor_;
  double seconds_ = 0, dropped_ = 0;
};

}  // namespace clerestory
