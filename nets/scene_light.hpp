// Who answers for radiance in a scene, whoever asks: the re-render, an edit, inserted objects, a panorama.
#pragma once
#include "nets/mixed_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {

/// Trained nets of the light.
struct LightNets {
  LightSizes sizes;
  int longer_side = 160;           // of the picture that they read
  std::shared_ptr<States> states;  // "local.*", "global.*"
  std::string note;                // what they are, for people
};

/// Rays as a light is asked along them, inside of map_chunks or outside.
struct AskedRays {
  Value points;     // where they start, camera metres: {1, 3, P, S}, or {1, 3, P, 1} for all rays of a row
  Value direction;  // {1, 3, P, S}: camera frame, pointing away; (0, 0, 0): none
  Lobes lobes;      // how the surface that asks sees them; no values where none does, or no lamp is there
  SsrtHits hits;    // on the scene's maps; no values where the light does not read them
  Value camera;     // {1, 4, 1, 1}
};

/// The light of one scene. What does not depend on rays (the nets' encoders, say) is in `inputs`, nodes of the graph it
/// was made in, so that it is computed once however many chunks of rays there are.
struct SceneLight {
  std::vector<Value> inputs;  // hand these into a map_chunks body, in this order
  bool traces = false;        // reads AskedRays::hits
  bool lamps = false;         // reads AskedRays::lobes
  double shared_answers = 0;  // of the in-view MLP, from which many rays are answered; 0: each asks it
  Value lamps_known;          // RenderSpec::lamps under settings.sampler = guided; no value: none
  int chunk_rays = 1 << 18;   // at most this many at once, so that what it keeps of them stays below half a GiB
  /// Radiance {1, 3, P, S} in the photograph's unit. `inputs`: the above, as the body sees them. Learned light appends
  /// to `counts`, unless it is null, how many rays each of its parts answered.
  std::function<Value(const AskedRays& rays, std::span<const Value> inputs, RayCounts* counts)> radiance;
  std::function<void(Executor&)> feed;  // graph inputs of its own, beside those of feed_scene()
  std::shared_ptr<States> states;       // for the executor; may be empty
};

/// The light that settings.light names, one of light_names(). Learned light reads settings.nets. `scene` is the one
/// that lights, without inserted objects. Throws usage_error: an unknown name, no nets, nets that lack a state.
/// settings.lamps are added. `rays_to_come`: about how many are asked in a run; many may share answers (learned_light).
SceneLight scene_light(Graph& graph, const SceneValues& values, const Scene& scene, const RenderSettings& settings,
                       double rays_to_come = 0);

/// The learned light that nets of these sizes answer for, out_of_view aside: net | li2020.
std::string light_of(const LightSizes& sizes);
/// Whether nets of these sizes are of the method that `light` is of; true of lights that are not learned.
bool nets_fit(const std::string& light, const LightSizes& sizes);
/// Throws usage_error where they are of another; `note` says which weights they are.
void check_method(const std::string& light, const LightSizes& sizes, const std::string& note);

/// Names that scene_light() knows.
const std::vector<std::string>& light_names();
/// Whether a light needs RenderSettings::nets. Throws usage_error on an unknown name.
bool is_learned_light(const std::string& name);
/// Whether it mixes what is in view with the net out of view, by the hit's uncertainty: net, completed.
bool mixes_by_hits(const std::string& name);
/// Whether the photograph answers, or has a say, where rays hit: image, net, completed.
bool traces_into_photograph(const std::string& name);

/// render_spec() as this light wants it: whether rays are traced, with lobes, how many at once.
RenderSpec render_spec(const RenderSettings& settings, const SceneLight& light);

/// For render(): pass inputs_of(light, points) with `points` = surface_points() of what is shaded, {1, 3, h, w}.
std::vector<Value> inputs_of(const SceneLight& light, Value points);
LightBuilder builder_of(const SceneLight& light);

/// Points of the chunk's pixels, {1, 3, P, 1}, for AskedRays. whole {1, 3, h, w}.
Value points_of_chunk(Value whole, Value direction);

}  // namespace clerestory
