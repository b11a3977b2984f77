// How a run was rendered, so that any of its samples can be taken again: render.json of a RUN folder.
#pragma once
#include <filesystem>
#include <vector>

#include "nets/render_scene.hpp"

namespace clerestory {

inline constexpr const char* kRenderRecord = "render.json";

/// Samples of one seed; a re-render of a fixed number has one round.
struct SampleRound {
  int spp = 0;
  std::uint32_t seed = 0;
};

struct RenderRecord {
  RenderSettings settings;  // with lamps; of nets the note alone, which says where they are
  std::vector<SampleRound> rounds;
  bool shared = false;                 // rays shared answers of the in-view MLP
  std::filesystem::path weights = {};  // of the light, as a file names them; to be written, settings.nets says it
  std::string weights_hash = {};       // as a file says it
};

void write_render_record(const std::filesystem::path& path, const RenderRecord& record);
/// What the file says, without settings.nets. Throws usage_error: no such file, not one of these.
RenderRecord parse_render_record(const std::filesystem::path& path);
/// The same, with settings.nets loaded for `device`. Throws usage_error also for nets that are not there, or
/// are others by now.
RenderRecord read_render_record(const std::filesystem::path& path, Device device);

}  // namespace clerestory
