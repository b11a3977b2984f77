// The report of a RUN folder, made from what lies in it: `invert`, `insert`, `edit`, `light` and `report` all end here.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "experiments/applications/run_folder.hpp"

namespace clerestory {

/// Writes `folder`/report.html: the photograph beside its re-render, what was made from the run and lies in its folder,
/// the maps, figures, times. Of an edit: the photograph before it and after. Throws usage_error when the folder is not
/// a run.
void write_run_report(const std::filesystem::path& folder);

/// Makes the report of `run` again when it shows `result`, made from it: a panorama, or the folder of an insertion or
/// an edit. Where that lies elsewhere, or another process is at work on the run, its report stays as it is, and that is
/// said.
void refresh_run_report(const std::filesystem::path& run, const std::filesystem::path& result);

/// How far a re-render is from its photograph, over the pixels that neither emit nor lack a depth: "PSNR 20.0 dB,
/// relMSE 0.040", of linear values (host/math/radiance.hpp). Nothing without such pixels. The
/// photograph is what a re-render aims at, not its truth: the light of both is assumed.
std::optional<std::string> error_against_photograph(const Scene& scene, const Image& render);

}  // namespace clerestory
