#include "experiments/training/report.hpp"

#include <algorithm>

#include "experiments/evaluation/real_scale.hpp"
#include "experiments/training/network.hpp"
#include "experiments/weights/weights.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "host/report/shared_text.hpp"

namespace clerestory {
namespace {

/// Curves whose names begin with `prefix`.
Plot curves(const std::vector<MetricRecord>& records, const std::string& prefix, const std::string& title,
            const std::string& y) {
  Plot plot;
  plot.title = title, plot.x_label = "step", plot.y_label = y, plot.log_y = true;
  for (const std::string& name : metric_names(records)) {
    if (!name.starts_with(prefix) || name == "train/rate") continue;
    Curve curve = curve_of(records, name);
    Series series;
    series.label = name.substr(prefix.size());
    series.x = std::move(curve.steps), series.y = std::move(curve.values);
    plot.series.push_back(std::move(series));
  }
  return plot;
}

/// Pictures of one size side by side; one channel becomes grey.
Image row_of(const std::vector<Image>& pictures) {
  const int width = pictures[0].width, height = pictures[0].height;
  Image row(static_cast<int>(pictures.size()) * width, height, 3);
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          row.at(c, y, static_cast<int>(i) * width + x) = pictures[i].at(std::min(c, pictures[i].channels - 1), y, x);
  return row;
}

/// The picture, what the net says of it and the truth, whose masked pixels are black: a row for each map.
void add_sample(HtmlReport& report, const ReportSample& sample) {
  const MapSet &p = sample.predicted, &t = sample.view.truth;
  const std::pair<double, double> range{0.01, 1};
  std::vector<Picture> rows;
  const auto add = [&](const std::string& name, const Image& predicted, const Image& truth,
                       const std::optional<ColourBar>& bar = {}) {
    rows.push_back(picture_of(name, row_of({show_radiance(sample.view.image), predicted, truth}), {}, bar));
    rows.back().columns = {"picture", "predicted", "truth"};
  };
  const auto part = [](const Image& material, int c) { return show_unit(channel(material, c)); };
  add("albedo", show_radiance(p.albedo), show_radiance(t.albedo));
  add("normals", show_normal(p.normal), show_normal(t.normal));
  add("depth", show_depth(p.depth, range), show_depth(t.depth, range), depth_bar(range, ""));
  add("roughness", part(p.material, 0), part(t.material, 0), unit_bar());
  add("metallic", part(p.material, 1), part(t.material, 1), unit_bar());
  report.pictures(rows, room_and_view(sample.name));
}

const CardPlots maps_plots{"validation.svg", "lists.svg"};
const CardPlots light_plots{"validation_light.svg", "lists_light.svg"};

/// The card of what these files hold together; its plots go beside it.
std::string card_of(const std::vector<std::filesystem::path>& files, const History& history,
                    const std::filesystem::path& folder, const CardPlots& names_of_plots) {
  const auto drawn = [&](const Plot& plot, const std::string& name) {
    return !plot.series.empty() && write_plot(folder / name, plot) ? name : std::string();
  };
  const CardPlots plots{drawn(history_plot(history), names_of_plots.validation),
                        drawn(lists_plot(history), names_of_plots.lists)};
  std::vector<std::string> names, sizes, hashes;
  for (const std::filesystem::path& file : files) {
    const FileRecord record = record_file(file);
    names.push_back(file.filename().string()), hashes.push_back(record.hash);
    sizes.push_back(fmt::format("{:.2f}", static_cast<double>(record.bytes) * 1e-6));
  }
  const Leg& last = history.legs.back();
  const bool light = last.kind == "light";
  std::vector<std::pair<std::string, std::string>> facts{
      {"file", fmt::format("{}", fmt::join(names, ", "))},
      {"size", fmt::format("{} MB, half precision", fmt::join(sizes, " + "))},
      {"hash (FNV-1a, 64 bit)", fmt::format("{}", fmt::join(hashes, ", "))},
      {"preset", last.preset},
      {"input", fmt::format("{}x{}, linear, 95th percentile of luminance at 0.9{}", last.width, last.height,
                            light ? "" : ", clamped to [0, 1], once as it is and once mirrored: the mean of both")},
      {"commit", last.commit}};
  if (const LightSizes net = light ? read_light_sizes(files[0]) : LightSizes{}; light && !net.li2020)
    facts.emplace_back("gain out of view",
                       fmt::format("{:g}, chosen after training; errors here are without it", net.out_of_view.gain));
  return model_card(history, facts, plots);
}

/// The scale of predicted depth on real photographs; nothing where it was not measured with these weights.
std::string real_scale_section(const std::filesystem::path& weights, const History& history) {
  const std::optional<RealScale> real = real_scale(weights, file_hash(weights));
  if (!real) return {};
  std::string text =
      "\n## Scale of depth on real photographs\n| frame | 99th percentile, predicted / measured | metres, predicted / "
      "measured, median over pixels |\n|---|---|---|\n";
  for (const ScaledFrame& frame : real->frames)
    text += fmt::format("| {} | {:.2f} | {:.2f} |\n", frame.name, frame.scale, frame.metres);
  return text +
         fmt::format(
             "\nTypically off by {}; {} seen in training. Measured by `clerestory evaluate --weights {} --frames FRAME "
             "... --json={}`.\n",
             real->text(), saw_photographs(history) ? "other photographs were" : "no photograph was",
             weights.filename().string(), frames_file(weights).filename().string());
}

}  // namespace

void check_weights_folder(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files) {
  namespace fs = std::filesystem;
  const auto refuse = [](const fs::path& file) {
    throw usage_error("a file that `clerestory weights export` did not write would be replaced", file.string(), "",
                      "another place, or move it away");
  };
  const auto says_its_training = [](const fs::path& file) {
    try {
      return !read_history(file).legs.empty();
    } catch (const Error&) {
      return false;
    }
  };
  for (const fs::path& file : files)
    if (fs::exists(file) && !says_its_training(file)) refuse(file);
  std::vector<fs::path> beside = weights_files(folder);
  beside.push_back(folder / "maps.safetensors");
  for (const fs::path& file : beside)
    if (std::ranges::count(files, file) == 0 && fs::exists(file) && !says_its_training(file))
      throw usage_error("the folder's card tells of these weights, which say nothing of their training", file.string(),
                        "", "another folder, or move them away");
  const fs::path card = folder / "CARD.md";
  const bool ours = fs::is_regular_file(card) && read_file(card, 1 << 24, true).starts_with("# Weights of ");
  if (ours) return;
  for (const std::string& name :
       {std::string("CARD.md"), maps_plots.validation, maps_plots.lists, light_plots.validation, light_plots.lists})
    if (fs::exists(folder / name)) refuse(folder / name);
}

std::filesystem::path write_folder_card(const std::filesystem::path& folder, const std::filesystem::path& maps) {
  std::string card;
  if (std::filesystem::exists(maps)) {
    const History history = read_history(maps);
    card = card_of({maps}, history, folder, maps_plots) + real_scale_section(maps, history);
  }
  const auto light = weights_files(folder);
  if (std::ranges::all_of(light, [](const auto& file) { return std::filesystem::exists(file); }))
    card += (card.empty() ? "" : "\n") + card_of(light, read_history(light[0]), folder, light_plots);
  write_file(folder / "CARD.md", card);
  return folder / "CARD.md";
}

std::string room_and_view(const std::filesystem::path& view) {
  return (view.parent_path().filename() / view.filename()).string();
}

void add_samples(HtmlReport& report, const std::vector<ReportSample>& samples) {
  report.section("Validation views", "Each map beside the truth. Depth is relative to scene_scale.");
  for (const ReportSample& sample : samples) add_sample(report, sample);
}

void write_training_report(const RunDirectory& run, const Config& config, const History& history,
                           const TrainingPage& page, const Provenance& provenance) {
  const std::filesystem::path artifacts = run / "artifacts", weights = artifacts / "weights.safetensors";
  write_file(artifacts / "card.md", card_of({weights}, read_history(weights), artifacts, maps_plots));
  // With the table beside the plot, `clerestory report` can make a report again from the files alone.
  write_file(run.artifact("validation.table.json"), table_json(page.table));
  const auto records = read_metrics(run.metrics_path());
  const Leg& leg = history.legs.back();
  HtmlReport report(leg.kind == "light" ? "Training of the light" : "Training of MGNet",
                    run.path().filename().string());
  report.section("Validation", "Errors over those of the best trivial predictor, through all legs.");
  for (const Plot& plot : {history_plot(history), lists_plot(history)})
    if (!plot.series.empty()) report.plot(plot);
  page.validation_views(report);
  report.section("Errors", "At the end of the leg, beside predictors that know nothing of the picture's content.");
  report.table(without_folders(page.table, provenance));
  if (!page.conventions.empty()) report.details("Conventions", page.conventions);
  report.section("Losses");
  if (const Plot losses = curves(records, "train/", "Training loss and its terms", "loss"); !losses.series.empty())
    report.plot(losses);
  if (const Plot ratios = curves(records, "val/ratio/", "Validation error over the best trivial predictor", "ratio");
      !ratios.series.empty())
    report.plot(ratios);
  report.section("How it was made");
  report.facts({{"preset", leg.preset},
                {"views", fmt::format("{} of {} rooms, {}x{}", leg.views, leg.rooms, leg.width, leg.height)},
                {"steps", fmt::format("{} of {} views", leg.steps, leg.batch)},
                {"time", duration_text(leg.hours * 3600)},
                {"speed", fmt::format("{:.0f} views an hour", static_cast<double>(leg.views_seen) / leg.hours)},
                {"score", fmt::format("{:.3f} (geometric mean of ratios to the best trivial predictor)",
                                      leg.curve.back().score)}});
  report.left_out(provenance.left_out);
  report.details("Configuration", without_folders(config_toml(config), provenance));
  report.footer(provenance);
  report.write(run / "report.html");
}

}  // namespace clerestory
