// `clerestory invert`: one photograph in; maps, re-render and report out.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/applications/light_choice.hpp"
#include "nets/render_until.hpp"

namespace clerestory {

/// A depth somebody measured: `metres` at image position (x, y).
struct KnownDepth {
  double x = 0, y = 0, metres = 0;
};

struct InvertOptions {
  std::filesystem::path photo;
  std::filesystem::path camera;       // camera.json; empty: `fov`
  std::optional<double> fov;          // horizontal, degrees; without it EXIF's, or 65 across the longer side
  std::filesystem::path gbuffer;      // folder of maps or ROOM/NNN that replace predicted ones
  std::vector<std::string> only;      // maps wanted: albedo, normal, depth, material; empty: all, and the re-render
  std::optional<double> depth_scale;  // metres of the 99th percentile of depth
  std::optional<KnownDepth> known;
  std::filesystem::path weights;  // empty: the shipped ones
  LightChoice lit_by;
  std::filesystem::path out;       // empty: runs/invert/<stem of the photo>, or a longer name if that is another's
  bool force = false;              // give up what `out` holds besides a run's own files
  std::string preset = "compact";  // paper: says what it will cost, and wants weights of that preset
  RenderSettings render;
  bool measure = false;            // time what was left out: a part of the rays is rendered with it
  std::optional<RenderGoal> goal;  // rounds of render.spp samples and more, in place of so many
  std::filesystem::path mask;      // of the pixels over which the goal's error is measured; empty: all
  std::string device, gemm = "auto", tile = "auto";
  std::vector<std::string> command;  // argv, for provenance
};

/// Writes the RUN folder, whole or not at all, and returns its path.
std::filesystem::path invert(const InvertOptions& options);

}  // namespace clerestory
