#include "experiments/studies/study_keys.hpp"

namespace clerestory {

void add_thickness_keys(Schema& schema) {
  schema.real("study.thickness", 0, "Metres behind a surface at which a ray passes unseen; 0: surfaces have no back",
              {0, 100});
}

void add_method_keys(Schema& schema) {
  schema
      .text("study.method", "",
            "Whose nets: zhu, li2020, or a folder of weights of maps and light; empty: by maps.weights and "
            "light.weights")
      .later();
}

void add_light_keys(Schema& schema) {
  schema.section("light", "Learned light.")
      .text("light.weights", "", "Its weights, a folder or a file; empty: the shipped ones")
      .real("light.gain", 0, "What the light out of view is multiplied by; 0: as its weights say", {0, 100})
      .later();
}

void add_maps_keys(Schema& schema) {
  schema.section("maps", "Predicted maps.").text("maps.weights", "", "MGNet's weights; empty: the shipped ones");
}

void add_rival_keys(Schema& schema) {
  schema.text(
      "study.rival", "",
      "Whose nets are judged beside: li2020, or a folder of weights of maps and light; empty: Li et al. 2020 are "
      "left out, and named as lacking");
}

std::string incident_text(const Config& config) {
  const double clamp = config.real("incident.clamp");
  return fmt::format(
      "{} photograph, {}", config.flag("incident.clipped_picture") ? "clipped" : "HDR",
      clamp > 0 ? fmt::format("in picture and truth one indirect contribution adds at most {:g} of the picture's white",
                              clamp)
                : std::string("no contribution clamped"));
}

void add_incident_keys(Schema& schema) {
  schema.section("incident", "Light along rays; study.seeds draws of rays.")
      .integer("incident.views", 3, "Views of each room", {1, 100})
      .integer("incident.points", 256, "Points of a view and draw: surfaces, and a fifth free probes", {1, 65536})
      .integer("incident.directions", 16, "Rays from each point, a multiple of 16", {16, 128})
      .integer("incident.ray_spp", 64, "Paths of the truth along a ray from a surface", {1, 65536})
      .integer("incident.probes", 2, "Free probes of a view; fewer where there is no place for them", {0, 100})
      .integer("incident.probe_spp", 64, "Paths of a texel in each of a probe's two estimates", {1, 65536})
      .real("incident.clamp", 1, "Most that one indirect contribution adds, in whites of the picture; 0: no bound",
            {0, 1e6})
      .flag("incident.clipped_picture", false, "Clamp the photograph to [0, 1], as a camera does; the truth never is");
  schema.text("data.maps", "true", "Maps; predicted ones with depth by the predicted scale", {"true", "predicted"});
}

}  // namespace clerestory
