#include "experiments/applications/run_report.hpp"

#include <cmath>

#include "experiments/applications/run_folder.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/html.hpp"
#include "host/report/preview.hpp"

namespace clerestory {
namespace {

Image mean_of_channels(const Image& image) {
  Image mean(image.width, image.height, 1);
  for (int c = 0; c < image.channels; ++c)
    for (std::size_t i = 0; i < mean.data.size(); ++i)
      mean.data[i] += image.plane(c)[i] / static_cast<float>(image.channels);
  return mean;
}

std::vector<Picture> map_pictures(const Scene& scene) {
  std::vector<Picture> pictures;
  if (!scene.albedo.data.empty()) pictures.push_back(picture_of("Albedo", show_radiance(scene.albedo)));
  if (!scene.material.data.empty()) {
    pictures.push_back(picture_of("Roughness", show_unit(channel(scene.material, 0)), "black 0, white 1"));
    pictures.push_back(picture_of("Metallic", show_unit(channel(scene.material, 1)), "black 0, white 1"));
  }
  if (!scene.normal.data.empty())
    pictures.push_back(picture_of("Normals", show_normal(scene.normal), "camera space: x red, y green, z blue"));
  if (!scene.depth.data.empty()) {
    const auto [near, far] = depth_range(scene.depth);
    pictures.push_back(
        picture_of("Depth", show_depth(scene.depth), fmt::format("{:.2f} to {:.2f} m, axial", near, far)));
  }
  return pictures;
}

/// Mean over the pixels that neither emit nor lack a measurement of (render - photo)^2 / (photo^2 + 0.01), and PSNR of
/// the clipped pictures. The photograph is the target of a re-render, not its truth: its light is what is assumed.
std::pair<double, double> agreement(const Scene& scene, const Image& render) {
  const std::size_t n = scene.photo.pixels();
  double relative = 0, squared = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (scene.material.data[2 * n + i] > 0 || scene.depth.data[i] <= 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double photo = scene.photo.data[c * n + i], value = render.data[c * n + i];
      relative += (value - photo) * (value - photo) / (photo * photo + 0.01);
      const double d = std::min(value, 1.0) - std::min(photo, 1.0);
      squared += d * d;
      ++count;
    }
  }
  return {count > 0 ? relative / count : 0, count > 0 ? -10 * std::log10(std::max(squared / count, 1e-12)) : 0};
}

std::string share(double part, double whole) { return fmt::format("{:.2f} %", whole > 0 ? 100 * part / whole : 0); }

Table times(const Provenance& provenance) {
  Table table;
  table.columns = {{"stage", "", Best::None, 3}, {"time", "s", Best::None, 3}};
  for (const auto& [name, value] : provenance.figures)
    if (name.rfind("seconds: ", 0) == 0) table.add({name.substr(9), Measure{value, 0, 1}});
  return table;
}

double figure(const Provenance& provenance, const std::string& name) {
  const auto found = provenance.figures.find(name);
  return found == provenance.figures.end() ? 0 : found->second;
}

std::vector<std::pair<std::string, std::string>> facts_of(const Scene& scene, const std::optional<Rerender>& rerender,
                                                          const Provenance& provenance) {
  std::vector<std::pair<std::string, std::string>> facts{
      {"Picture", fmt::format("{} x {} pixels", scene.width(), scene.height())},
      {"Field of view", fmt::format("{:.1f}° horizontal", scene.camera.fov_degrees())}};
  for (const auto& [name, value] : provenance.facts) facts.emplace_back(name, value);
  if (!rerender) return facts;
  const double rays = figure(provenance, "rays");
  const auto [relative, psnr] = agreement(scene, rerender->radiance);
  facts.emplace_back("Rays", fmt::format("{:.2f} million, {} end on a visible surface", rays * 1e-6,
                                         share(figure(provenance, "rays that hit"), rays)));
  for (const std::string part : {"in view", "out of view"})
    if (const double asked = figure(provenance, "rays answered " + part); asked > 0)
      facts.emplace_back("Rays answered " + part, share(asked, rays));
  facts.emplace_back("Samples dropped (not finite)", share(figure(provenance, "samples dropped"), rays));
  facts.emplace_back("Pixels facing away, not shaded",
                     share(figure(provenance, "pixels facing away"), static_cast<double>(scene.photo.pixels())));
  facts.emplace_back("Emitting pixels, masked", fmt::format("{:.2f} %", 100 * emitting_share(scene.material)));
  facts.emplace_back("Re-render against photograph", fmt::format("PSNR {:.1f} dB, relMSE {:.3f}", psnr, relative));
  facts.emplace_back("Standard error, median", fmt::format("{:.4f}", median(rerender->standard_error.data)));
  return facts;
}

Image exposed(Image image, double exposure) {
  for (float& v : image.data) v = static_cast<float>(v * exposure);
  return image;
}

}  // namespace

void write_run_report(const std::filesystem::path& folder) {
  const Provenance provenance = read_provenance(folder / "provenance.json");
  const Scene scene = read_run_maps(folder);
  std::optional<Rerender> rerender;
  if (std::filesystem::exists(folder / "rerender.exr")) rerender = read_rerender(folder);
  const double exposure = exposure_of(scene.photo.data);

  HtmlReport report("A room taken apart", provenance.inputs.empty() ? "" : provenance.inputs[0].path);
  report.facts(facts_of(scene, rerender, provenance));
  if (rerender) {
    report.section(
        "Photograph and re-render",
        "The re-render is made from maps, camera and light by Monte Carlo. It holds reflected light only: lamps "
        "and windows are dark in it.");
    report.compare("Photograph", exposed(scene.photo, exposure), "Re-render", exposed(rerender->radiance, exposure),
                   "Scaled so that the photograph's 95th percentile is 0.9.");
  }
  if (std::filesystem::exists(folder / "insert.json")) {  // a folder of edit has a composite of its own
    const Provenance inserted = read_provenance(folder / "insert.json");
    const auto light = inserted.facts.find("light");
    report.section("Objects put in",
                   "Lit by the scene (light: " + (light == inserted.facts.end() ? "image" : light->second) +
                       "), shadowing it and mirrored in it.");
    report.compare("Photograph", exposed(scene.photo, exposure), "With objects",
                   exposed(read_map(folder / "composite.exr", 3), exposure));
    if (const auto scale = inserted.facts.find(kDepthScaleFact); scale != inserted.facts.end())
      report.paragraph("Scale of the room, on which sizes of objects in metres rest: " + scale->second + ".");
    report.paragraph(command_text(inserted.command) + fmt::format(" ({:.1f} s)", figure(inserted, "seconds")));
  }
  report.section("Maps");
  report.pictures(map_pictures(scene));
  if (rerender) {
    report.section("How sure",
                   "Standard error of the Monte Carlo estimate, as independent samples have it: an upper bound under "
                   "Sobol points, whose spread over seeds is about half of it. And the mean uncertainty u of each "
                   "pixel's rays: 1 where they leave the picture or pass "
                   "behind what is seen.");
    report.pictures({picture_of("Standard error", show_amount(mean_of_channels(rerender->standard_error))),
                     picture_of("Uncertainty", show_unit(rerender->uncertainty), "black 0, white 1")});
  }
  report.section("Time");
  report.table(times(provenance));
  report.left_out(provenance.left_out);
  if (std::filesystem::exists(folder / "plan.txt"))
    report.details("What the device runs", read_file(folder / "plan.txt"));
  report.footer(provenance);
  report.write(folder / "report.html");
}

}  // namespace clerestory
