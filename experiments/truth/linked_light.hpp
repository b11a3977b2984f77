// The learned light as a chain of links, each of which the tracer can answer in its place: whether and where a ray hits
// what the picture shows, what is seen there, what comes from out of view. The maps are the fourth link: whoever asks
// hands in predicted or true ones.
#pragma once
#include <optional>
#include <vector>

#include "experiments/truth/host_rays.hpp"
#include "nets/scene_radiance.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Links that are true. With true hits a ray's uncertainty is 0 or 1; the true radiance is that along the ray itself,
/// whichever link asks for it, so with both radiances true the hits no longer matter.
struct Links {
  bool hits = false, in_view = false, out_of_view = false;

  bool all_light() const { return in_view && out_of_view; }
  bool operator==(const Links&) const = default;
};

/// Everything that any choice of links asks of some rays; radiances planar {3, count}, in the photograph's unit.
struct LinkAnswers {
  std::vector<float> truth;         // one path of the tracer
  std::vector<float> mixed, far;    // net: both parts by traced hits; the out-of-view part alone
  std::vector<float> u;             // of the traced hits
  std::vector<float> at_true_hits;  // net: in view at true_pixel, out of view elsewhere
  std::vector<int> true_pixel;      // or -1
};

/// Eq. 6 of Zhu et al. 2022 with links replaced: (1 - u) in view + u out of view.
std::vector<float> linked_radiance(const LinkAnswers& answers, const Links& links);

/// What the layer shades, and where that truly is.
struct ShadedSurface {
  Scene maps;            // predicted or true; a pixel without depth is not shaded; no photograph is read
  Image depth, normal;   // true: the tracer's rays start there
  bool of_scene = true;  // pixels lie on the scene's own surface, which their rays skip; false: an object before it
};

/// Seconds of one set of rays by who spent them.
struct LinkSeconds {
  double layer = 0, nets = 0, hits = 0, truth = 0;  // nets: or the light in their place
  /// What a choice of links needs of them.
  double of(const Links& links) const;
};

struct LinkedPictures {
  std::vector<Image> radiance;  // one for each choice of links, in their order
  std::vector<bool> shaded;     // pixels
  LinkSeconds seconds;
  double dropped = 0;  // paths that were not finite
};

class LinkedLight {
 public:
  /// `scene` lights: its maps are the link that is predicted or true. settings.nets answer.
  LinkedLight(Device device, const Scene& scene, const RenderSettings& settings);
  ~LinkedLight();

  /// The layer's pictures of one set of rays. `traced` is the true room, its radiance times `exposure` has the
  /// photograph's unit. What true rays bring from the emitters they end on is summed over rays of its own,
  /// `emission_spp` a pixel: they need no paths, and lamps are small. Equal settings draw equal rays.
  LinkedPictures render(TraceScene& traced, double exposure, const ShadedSurface& surface,
                        const RenderSettings& settings, const std::vector<Links>& choices, int emission_spp);
  /// One picture, of the very rays, under a light by its name in studies (under_light): no link is replaced.
  LinkedPictures render_plain(const ShadedSurface& surface, const std::string& light, const RenderSettings& settings);

 private:
  struct State;
  LinkedPictures render_reflected(TraceScene& traced, double exposure, const ShadedSurface& surface,
                                  const RenderSettings& settings, const std::vector<Links>& choices);
  void add_emission(TraceScene& traced, double exposure, const ShadedSurface& surface, const RenderSettings& settings,
                    const std::vector<Links>& choices, int spp, LinkedPictures& result);

  std::unique_ptr<State> state_;
};

}  // namespace clerestory
