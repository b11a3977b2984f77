#include "experiments/applications/run_report.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/run_results.hpp"
#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/report/html.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "host/report/shared_text.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::pair<std::string, std::string>>;

constexpr std::uint64_t kMostPlan = std::uint64_t{64} << 20;  // bytes of plan.txt
constexpr int kMostlyAfter = 10;  // percent of the width that the photograph before a change has at first

double figure(const Provenance& provenance, const std::string& name) {
  const auto found = provenance.figures.find(name);
  return found == provenance.figures.end() ? 0 : found->second;
}

std::string fact(const Provenance& provenance, const std::string& name) {
  const auto found = provenance.facts.find(name);
  return found == provenance.facts.end() ? "" : found->second;
}

// --- Pictures --------------------------------------------------------------------------------------------------------

void add_maps(std::vector<Picture>& pictures, const Scene& scene, const std::string& depth_scale) {
  if (!scene.albedo.data.empty())
    pictures.push_back(
        picture_of("Albedo", show_radiance(scene.albedo), "share of light that is reflected, by colour"));
  if (!scene.normal.data.empty())
    pictures.push_back(
        picture_of("Normals", show_normal(scene.normal), "red to the right, green up, blue towards the viewer"));
  if (!scene.depth.data.empty()) {
    const auto range = depth_range(scene.depth);
    const bool predicted = depth_scale.find(kPredictedScale) != std::string::npos;
    pictures.push_back(picture_of(
        "Depth", show_depth(scene.depth, range),
        fmt::format("along the view axis{}; colours from the 2nd to the 98th percentile, grey where there is none",
                    predicted ? ", metres as predicted" : ""),
        depth_bar(range)));
  }
  if (!scene.material.data.empty()) {
    pictures.push_back(
        picture_of("Roughness", show_unit(channel(scene.material, 0)), "0 a mirror, 1 matt", unit_bar()));
    pictures.push_back(
        picture_of("Metallic", show_unit(channel(scene.material, 1)), "1 metal, 0 all else", unit_bar()));
  }
}

void add_certainty(HtmlReport& page, const Rerender& rerender) {
  const double most = amount_range(rerender.standard_error);
  page.section("How sure");
  page.pictures(
      {picture_of("Standard error", show_amount(rerender.standard_error, most),
                  "of the Monte Carlo estimate, in the photograph's unit, mean of the channels; as independent "
                  "samples have it: an upper bound under Sobol points, whose spread over seeds is about half "
                  "of it",
                  amount_bar(most)),
       picture_of("Uncertainty", show_unit(rerender.uncertainty),
                  "u, mean over each pixel's rays: 1 where they leave the picture or pass behind what is seen",
                  unit_bar())});
}

// --- What was made from the run --------------------------------------------------------------------------------------

std::string name_in(const fs::path& run, const fs::path& file) { return file.lexically_relative(run).string(); }

/// A file of a result, the time it took, and the command that made it.
void add_origin(HtmlReport& page, const std::string& file, const Provenance& record) {
  page.paragraph(fmt::format("{}, in {:.1f} s by", file, figure(record, "seconds")));
  page.command(record);
}

void add_insertions(HtmlReport& page, const std::vector<RunResult>& insertions, const Scene& scene,
                    const fs::path& run) {
  if (insertions.empty()) return;
  page.section("Objects put in");
  for (const RunResult& made : insertions) {
    page.compare("Photograph", scene.photo, "With objects", read_map(made.picture, 3),
                 fmt::format("Lit by the room, shadowing it and mirrored in it. Light: {}.",
                             without_folders(fact(made.record, "light"), made.record)),
                 kMostlyAfter);
    if (const std::string scale = fact(made.record, kDepthScaleFact); !scale.empty())
      page.paragraph(
          "Scale of the room, on which sizes of objects in metres rest: " + without_folders(scale, made.record) + ".");
    add_origin(page, name_in(run, made.picture), made.record);
  }
}

void add_edits(HtmlReport& page, const std::vector<RunResult>& edits, const Scene& scene, const fs::path& run) {
  if (edits.empty()) return;
  page.section("Materials replaced");
  for (const RunResult& made : edits) {
    const fs::path folder = made.picture.parent_path();
    page.compare("Photograph", scene.photo, "Edited", read_map(made.picture, 3),
                 fmt::format("{}. More on its own page, {}.", fact(made.record, kEditFact),
                             name_in(run, folder / "report.html")),
                 kMostlyAfter);
    add_origin(page, name_in(run, folder / "composite.exr"), made.record);
  }
}

void add_panoramas(HtmlReport& page, const std::vector<RunResult>& panoramas, const Scene& scene, const fs::path& run) {
  if (panoramas.empty()) return;
  page.section(
      "Light at points",
      "What arrives there from everywhere, under the photograph's exposure. The middle looks the camera's way, "
      "a quarter to the right of it lies the camera's right, the upper edge is up.");
  std::vector<Picture> pictures;
  for (const RunResult& made : panoramas) {
    const std::string place = without_folders(fact(made.record, "place"), made.record);
    pictures.push_back(picture_of(
        "At " + fact(made.record, kPointFact) + " m",
        show_radiance(read_map(made.picture, 3), shown_exposure(scene.photo)),
        fmt::format("{}; light: {}{}{}", name_in(run, made.picture),
                    without_folders(fact(made.record, "light"), made.record), place.empty() ? "" : "; ", place)));
  }
  page.pictures(pictures, "Points in the camera's metres: x right, y up, z towards the viewer.");
}

// --- Figures ---------------------------------------------------------------------------------------------------------

/// "none", "42.4 %", "less than 0.01 %".
std::string share(double part, double whole) {
  const double percent = whole > 0 ? 100 * part / whole : 0;
  if (percent == 0) return "none";
  return percent < 0.01 ? "less than 0.01 %" : fmt::format("{:.3g} %", percent);
}

/// Of a re-render: what of it comes from the photograph it stands beside.
std::string light_caption(const Provenance& provenance) {
  const std::string light = fact(provenance, "light");
  const bool learned = light.starts_with("net") || light.starts_with("out_of_view") || light.starts_with("li2020");
  if (provenance.facts.contains("lamps") && !fact(provenance, "lamps").starts_with("none"))
    return " Lamps were fitted to the photograph, so that it is no judgement of the maps alone.";
  if (light.empty() || learned) return "";
  return " Its light is taken from the photograph itself (" + light +
         "), so that it is no judgement of the maps alone.";
}

/// What became of the rays, in sentences.
std::string rays_text(const Scene& scene, const Provenance& provenance) {
  const double rays = figure(provenance, "rays");
  std::string text = fmt::format(
      "Of {:.2f} million rays that left the surfaces in the picture, {} end on a surface that the picture shows; the "
      "others leave it or pass behind what is seen. ",
      rays * 1e-6, share(figure(provenance, "rays that hit"), rays));
  if (provenance.figures.contains("rays answered in view"))
    text += fmt::format(
        "The learned light in view was asked about {} of all rays, the one out of view about {}: about a ray whose hit "
        "is uncertain, both. ",
        share(figure(provenance, "rays answered in view"), rays),
        share(figure(provenance, "rays answered out of view"), rays));
  text += fmt::format("Samples dropped because they were not finite: {}. ",
                      share(figure(provenance, "samples dropped"), rays));
  text += fmt::format("Pixels not shaded because their normal faces away: {}. ",
                      share(figure(provenance, "pixels facing away"), static_cast<double>(scene.photo.pixels())));
  if (scene.material.data.empty()) return text;
  return text + fmt::format("Pixels that emit light themselves, dark in the re-render and in no comparison: {}.",
                            share(emitting_share(scene.material), 1));
}

Texts figures_of(const Scene& scene, const std::optional<Rerender>& rerender) {
  Texts texts{{"Picture", fmt::format("{} x {} pixels", scene.width(), scene.height())},
              {"Field of view", fmt::format("{:.1f}° horizontal", scene.camera.fov_degrees())}};
  if (!rerender) return texts;
  if (const auto error = error_against_photograph(scene, rerender->radiance))
    texts.emplace_back("Re-render against photograph", *error);
  texts.emplace_back("Standard error, median", fmt::format("{:.4f}", median(rerender->standard_error.data)));
  return texts;
}

void add_figures(HtmlReport& page, const Scene& scene, const std::optional<Rerender>& rerender,
                 const Provenance& provenance) {
  page.section("In figures").facts(figures_of(scene, rerender));
  if (rerender) page.paragraph(rays_text(scene, provenance));
  Texts notes;
  for (const auto& [name, value] : provenance.facts) notes.emplace_back(name, without_folders(value, provenance));
  page.notes(notes);
}

// --- Time ------------------------------------------------------------------------------------------------------------

/// A stage of `invert` or `edit`, in the order in which they come, and those that are part of it.
struct Stage {
  const char *key, *name;  // figure "seconds: KEY"
  std::vector<std::pair<const char*, const char*>> parts;
};
const std::vector<Stage>& stages() {
  static const std::vector<Stage> all{{"reading", "reading", {}},
                                      {"network", "nets of the maps", {}},
                                      {"light", "light", {{"lamps", "fitting lamps"}}},
                                      {"render", "render", {}},
                                      {"re-render",
                                       "re-render",
                                       {{"re-render, light's networks", "the light's nets over the picture"},
                                        {"re-render, SSRT", "following rays over the depth map"},
                                        {"re-render, in-view MLP", "light in view"},
                                        {"re-render, out of view", "light out of view"},
                                        {"re-render, lamps", "light of lamps"},
                                        {"re-render, shading", "directions and shading"}}},
                                      {"measuring what was left out", "measuring what was left out", {}},
                                      {"writing", "writing", {}}};
  return all;
}

void add_times(HtmlReport& page, const Provenance& provenance) {
  Table table;
  table.columns = {{"stage"}, {"time", "s"}};
  const auto add = [&](const std::string& name, double seconds) { table.add({name, Measure{seconds, 0, 1}}); };
  double together = 0;
  for (const Stage& stage : stages()) {
    const double seconds = figure(provenance, fmt::format("seconds: {}", stage.key));
    if (seconds == 0) continue;
    add(stage.name, seconds);
    together += seconds;
    for (const auto& [key, name] : stage.parts)
      if (const double part = figure(provenance, fmt::format("seconds: {}", key)); part > 0)
        add(fmt::format("\u2003in it: {}", name), part);
  }
  const double all = std::max(figure(provenance, "seconds"), together);  // `edit` records the whole
  if (all > together) add("all else", all - together);
  add("together", all);
  const double building = figure(provenance, "seconds: building kernels");
  page.section("Time").table(table, building > 0 ? fmt::format("Building kernels took {:.3g} s of it.", building) : "");
}

// --- An edit ---------------------------------------------------------------------------------------------------------

/// The photograph that an edit began with, where it still is.
std::optional<Image> photograph_before(const fs::path& folder, const Provenance& provenance) {
  if (provenance.inputs.empty()) return {};
  for (const fs::path& path : {fs::path(provenance.inputs[0].path), fs::canonical(folder).parent_path() / "photo.exr"})
    if (fs::is_regular_file(path) && file_hash(path) == provenance.inputs[0].hash) return read_map(path, 3);
  return {};
}

void add_edited(HtmlReport& page, const fs::path& folder, const Scene& scene, const Provenance& provenance) {
  page.section("Before and after");
  const auto before = photograph_before(folder, provenance);
  if (before && before->width == scene.width() && before->height == scene.height())
    page.compare("Photograph", *before, "Edited", scene.photo, "", kMostlyAfter);
  else
    page.pictures({picture_of("Edited", show_radiance(scene.photo, shown_exposure(scene.photo)))},
                  "The run that was edited has gone: nothing to compare with.");
}

/// Whether the page of `run` has `result`, a picture or the folder of one.
bool is_shown(const fs::path& run, const fs::path& result) {
  const RunResults all = results_of_run(run);
  const fs::path wanted = own_path(result);
  const auto has = [&](const std::vector<RunResult>& results) {
    return std::ranges::any_of(results, [&](const RunResult& made) {
      const fs::path picture = own_path(made.picture);
      return picture == wanted || picture.parent_path() == wanted;
    });
  };
  return has(all.insertions) || has(all.edits) || has(all.panoramas);
}

}  // namespace

std::optional<std::string> error_against_photograph(const Scene& scene, const Image& render) {
  if (scene.material.data.empty() || scene.depth.data.empty()) return {};
  const std::size_t n = scene.photo.pixels();
  const double exposure = shown_exposure(scene.photo);
  double relative = 0, clipped = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (scene.material.data[2 * n + i] > 0 || scene.depth.data[i] <= 0) continue;
    for (std::size_t c = 0; c < 3; ++c, ++count) {
      const double value = exposure * render.data[c * n + i], photo = exposure * scene.photo.data[c * n + i];
      relative += relative_square(value, photo);
      clipped += std::pow(std::min(value, 1.0) - std::min(photo, 1.0), 2);
    }
  }
  if (count == 0) return {};
  return fmt::format("PSNR {:.1f} dB, relMSE {:.3f}", -10 * std::log10(std::max(clipped / count, 1e-12)),
                     relative / count);
}

namespace {

void check_size(const Rerender& rerender, const Scene& scene, const fs::path& folder) {
  for (const auto& [name, map] : {std::pair{"rerender.exr", &rerender.radiance},
                                  {"stderr.exr", &rerender.standard_error},
                                  {"uncertainty.exr", &rerender.uncertainty}})
    if (map->width != scene.width() || map->height != scene.height())
      throw usage_error("is of another size than the photograph", (folder / name).string(),
                        fmt::format("{}x{}", map->width, map->height),
                        fmt::format("{}x{}", scene.width(), scene.height()));
}

}  // namespace

void write_run_report(const fs::path& folder) {
  const Provenance provenance = read_provenance(folder / kProvenanceName);
  const Scene scene = read_run_maps(folder);
  std::optional<Rerender> rerender;
  if (fs::exists(folder / "rerender.exr")) rerender = read_rerender(folder), check_size(*rerender, scene, folder);
  const std::string edit = fact(provenance, kEditFact);
  const std::string photo = provenance.inputs.empty() ? "" : without_folders(provenance.inputs[0].path, provenance);
  const RunResults results = results_of_run(folder);

  HtmlReport page(edit.empty() ? "A room taken apart" : "A material replaced", edit.empty() ? photo : edit);
  if (!edit.empty()) add_edited(page, folder, scene, provenance);
  if (rerender) {
    page.section("Photograph and re-render");
    page.compare(
        "Photograph", scene.photo, "Re-render", rerender->radiance,
        "The re-render is made from maps, camera and light by Monte Carlo. It holds reflected light only: lamps "
        "and windows are dark in it." +
            light_caption(provenance));
  }
  add_insertions(page, results.insertions, scene, folder);
  add_edits(page, results.edits, scene, folder);
  add_panoramas(page, results.panoramas, scene, folder);
  std::vector<Picture> maps;
  if (!rerender && edit.empty())
    maps.push_back(picture_of("Photograph", show_radiance(scene.photo, shown_exposure(scene.photo))));
  if (fs::exists(folder / "mask.png")) maps.push_back(picture_file("Mask", folder / "mask.png", "white: edited"));
  add_maps(maps, scene, fact(provenance, kDepthScaleFact));
  page.section("Maps").pictures(maps);
  if (rerender) add_certainty(page, *rerender);
  add_figures(page, scene, rerender, provenance);
  add_times(page, provenance);
  page.left_out(provenance.left_out);
  if (fs::exists(folder / "plan.txt"))
    page.details("What the device runs", without_folders(read_file(folder / "plan.txt", kMostPlan, true), provenance));
  page.footer(provenance);
  page.write(folder / "report.html");
}

void refresh_run_report(const fs::path& run, const fs::path& result) {
  if (!fs::exists(run / kProvenanceName)) return;
  if (!is_shown(run, result)) {
    say(fmt::format("{} is not on the page of {}, which shows what lies in its folder or directly in a folder there",
                    result.string(), run.string()));
    return;
  }
  try {
    const FolderLock lock = lock_run(run, LockKind::Write);
    write_run_report(run);
  } catch (const Error& error) {
    say(fmt::format("{}: its report was not made again ({}); `clerestory report` makes it", run.string(),
                    error.what()));
  }
}

}  // namespace clerestory
