// A RUN folder of `clerestory invert`: what it holds and how it is read back by insert, report and evaluate.
//   albedo.exr normal.exr depth.exr material.exr rerender.exr stderr.exr uncertainty.exr camera.json provenance.json
//   report.html, PNG previews, and photo.exr: the photograph in linear radiance, so that the folder stands alone.
#pragma once
#include <filesystem>
#include <optional>

#include "host/io/image.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// What the Monte Carlo layer gave. Absent when only some maps were asked for (`--only`).
struct Rerender {
  Image radiance;        // 3
  Image standard_error;  // 3
  Image uncertainty;     // 1: mean u of the pixel's rays
};

/// One channel of an image, as an image.
Image channel(const Image& image, int c);

/// Writes the maps of `scene` that are not empty, the re-render, camera.json and PNG previews into `folder`.
void write_run(const std::filesystem::path& folder, const Scene& scene, const std::optional<Rerender>& rerender);

/// Reads a whole scene back. Throws usage_error naming the missing file: a folder made with `--only` cannot be used.
Scene read_run(const std::filesystem::path& folder);
/// The same without that demand: maps that the folder lacks stay empty.
Scene read_run_maps(const std::filesystem::path& folder);
Rerender read_rerender(const std::filesystem::path& folder);

}  // namespace clerestory
