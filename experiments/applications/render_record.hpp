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
  bool shared = false;  // rays shared answers of the in-view MLP
};

void write_render_record(const std::filesystem::path& path, const RenderRecord& record);
/// settings.nets are loaded for `device`. Throws usage_error: no such file, not one of these, nets that are not there.
RenderRecord read_render_record(const std::filesystem::path& path, Device device);

}  // namespace clerestory
