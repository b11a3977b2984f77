// The report of an inverted photograph.
#pragma once
#include <filesystem>
#include <optional>

#include "experiments/applications/run_folder.hpp"
#include "host/report/provenance.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

/// What invert() learned on its way, for the report.
struct InvertRecord {
  Provenance provenance;
  Rendering rendering;  // empty images with --only
};

void write_invert_report(const std::filesystem::path& path, const Scene& scene, const std::optional<Rerender>& rerender,
                         const InvertRecord& record);

}  // namespace clerestory
