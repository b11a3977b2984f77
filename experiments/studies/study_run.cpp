#include "experiments/studies/study_run.hpp"

#include <cstdio>

#include "experiments/run_directory_report.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/report/progress.hpp"

namespace clerestory {

StudyRun::StudyRun(const Config& config, const std::vector<std::string>& command)
    : config_(config),
      run_(config.text("run.root"), config.text("run.experiment"), config.text("run.variant"), config,
           static_cast<std::uint64_t>(config.integer("run.seed"))),
      device_(Device::open(config.text("run.device"))),
      provenance_(begin_provenance(command, device_.fingerprint())) {}

std::string StudyRun::run() {
  if (run_.done()) {
    say("study: done before, skipped: " + run_.path().string());
    return run_.path().string();
  }
  catch_interrupts();
  records_ = read_metrics(run_.metrics_path());
  measure();
  conclude();
  provenance_.ended = utc_now();
  write_provenance(run_ / "provenance.json", provenance_);
  run_.finish();
  write_run_directory_report(run_.path());
  return run_.path().string();
}

void StudyRun::measure_rooms(
    const std::function<void(std::int64_t room, std::uint64_t seed, const RoomAssets& assets)>& measure_room) const {
  const RoomAssets assets = load_assets(default_assets(), Setting::Training);
  const std::int64_t rooms = config_.integer("data.rooms");
  const auto done = static_cast<std::int64_t>(records_.size());
  const Random seeds(static_cast<std::uint64_t>(config_.integer("data.seed")));
  Progress progress("study", rooms, "rooms", done);
  for (std::int64_t r = done; r < rooms; ++r) {
    measure_room(r, seeds.fork(static_cast<std::uint64_t>(r)).bits(), assets);
    progress.advance();
  }
}

GenerateOptions StudyRun::view_options() const {
  GenerateOptions options;
  options.out = run_ / "data", options.rooms = static_cast<int>(config_.integer("data.rooms")), options.views = 1;
  options.width = static_cast<int>(config_.integer("data.width"));
  options.height = static_cast<int>(config_.integer("data.height"));
  options.spp = static_cast<int>(config_.integer("data.spp"));
  options.seed = static_cast<std::uint64_t>(config_.integer("data.seed"));
  options.light = false;  // studies ask the tracer itself
  options.split = "test", options.interrupted = [] { return interrupted(); };
  return options;
}

std::vector<std::filesystem::path> StudyRun::make_views(const GenerateOptions& options) {
  generate(device_, options);
  std::vector<std::filesystem::path> views;
  for (const std::string& room : list_rooms(options.out, "test")) views.push_back(options.out / room / "000");
  return views;
}

void StudyRun::write_table(const std::string& name, const Table& table) const {
  write_file(run_.artifact(name + ".table.json"), table_json(table));
  std::fputs(table_text(table).c_str(), stdout);
}

void StudyRun::add_record(MetricRecord record) {
  MetricsWriter(run_.metrics_path()).write(record.step, record.values);
  records_.push_back(std::move(record));
}

std::optional<double> StudyRun::value_of(std::size_t record, const std::string& key) const {
  for (const auto& [name, value] : records_[record].values)
    if (name == key) return value;
  return std::nullopt;
}

std::vector<double> StudyRun::values_of(const std::string& key) const {
  std::vector<double> values;
  for (std::size_t r = 0; r < records_.size(); ++r)
    if (const std::optional<double> value = value_of(r, key)) values.push_back(*value);
  return values;
}

}  // namespace clerestory
