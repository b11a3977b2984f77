// What a finished leg of training shows: report.html, card.md and the plot of validation error against hours.
#pragma once
#include <functional>

#include "experiments/weights/history.hpp"
#include "host/report/html.hpp"
#include "host/report/run_directory.hpp"

namespace clerestory {

/// A validation view beside what the net says about it.
struct ReportSample {
  std::string name;
  PreparedView view;
  MapSet predicted;
};

/// What a task has to show of its last validation.
struct TrainingPage {
  Table table;
  std::string conventions;                            // behind the table; may be empty
  std::function<void(HtmlReport&)> validation_views;  // pictures
};
/// "room/view" of a view's place: pages name no folder of a computer.
std::string room_and_view(const std::filesystem::path& view);
/// Each map beside the truth.
void add_samples(HtmlReport& report, const std::vector<ReportSample>& samples);

/// Writes report.html into the run (curves and pictures first, then tables, then how it was made), card.md and
/// validation.svg into its artifacts, from metrics.jsonl and the history.
void write_training_report(const RunDirectory& run, const Config& config, const History& history,
                           const TrainingPage& page, const Provenance& provenance);

/// Throws usage_error when weights, CARD.md or its plots written into `folder` would replace what was not written so:
/// `files`, the weights, that say nothing of their training, another card, plots without a card.
void check_weights_folder(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files);

/// CARD.md for the weights that lie in `folder`, with its plots: the maps of `maps`, if there is such a file, then the
/// light of light_local and light_global.safetensors, if both are there. Returns its path.
std::filesystem::path write_folder_card(const std::filesystem::path& folder, const std::filesystem::path& maps);

}  // namespace clerestory
