#include "experiments/studies/study_run.hpp"

#include <algorithm>
#include <cstdio>

#include "experiments/applications/light_choice.hpp"
#include "experiments/studies/run_directory_report.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLacking = "lacking";  // fact of the provenance

bool is_seed(const std::string& key) { return key.ends_with(".seed") || key.ends_with(".seeds"); }

/// Seeds, and counts of seeds, that the config names.
std::map<std::string, std::uint64_t> seeds_of(const Config& config) {
  std::map<std::string, std::uint64_t> seeds;
  for (const auto& [key, entry] : config.entries())
    if (is_seed(key) && (entry.origin != "default" || key == "data.seed"))
      seeds[key] = static_cast<std::uint64_t>(config.integer(key));
  return seeds;
}

/// What a finished run was made with and is no longer so, for people.
std::string changes_since(const Provenance& made) {
  std::vector<std::string> changed;
  const auto kernels = made.hashes.find("kernels");
  if (kernels != made.hashes.end() && kernels->second != kernels_hash()) changed.push_back("the kernels");
  for (const FileRecord& input : made.inputs)
    if (!fs::exists(input.path) || file_hash(input.path) != input.hash) changed.push_back(input.path);
  return fmt::format("{}", fmt::join(changed, ", "));
}

}  // namespace

std::string rival_label(const Method& rival) {
  return rival.name == "li2020" ? "Li et al. 2020" : rival.maps.parent_path().filename().string();
}

std::string StudyRun::own_label() const {
  return method_ && config_.text("study.method") != "zhu" ? rival_label(*method_) : "Clerestory";
}

StudyRun::StudyRun(const Config& config, const std::vector<std::string>& command)
    : config_(config),
      rooms_(rooms_of(read_room_list(config.text("data.list")), static_cast<std::size_t>(config.integer("data.rooms")),
                      static_cast<std::uint64_t>(config.integer("data.seed")))),
      device_(Device::open(config.text("run.device"))),
      run_(config.text("run.root"), config.text("run.experiment"), config.text("run.variant"), config,
           static_cast<std::uint64_t>(config.integer("run.seed"))),
      provenance_(begin_provenance(command, device_.fingerprint())) {
  device_.use_gemm(config.text("run.gemm"));
  provenance_.hashes = {{"config", config_hash(config_)}, {"kernels", kernels_hash()}};
  provenance_.seeds = seeds_of(config_);
}

std::string StudyRun::run() {
  if (run_.done()) {
    say("study: done before, skipped: " + run_.path().string());
    const std::string changes = changes_since(read_provenance(run_ / "provenance.json"));
    if (!changes.empty())
      say("study: since then these have changed: " + changes + "; without that folder it runs again");
    return run_.path().string();
  }
  catch_interrupts();
  bool goes_on = false;
  try {
    choose_method();
    go_on();
    goes_on = true;
    measure();
    conclude();
  } catch (const Error& error) {
    // What was found before is as good as it was if this process may not go on from it.
    if (goes_on || records_.empty()) run_.fail(error, !records_.empty());
    throw;
  }
  provenance_.figures["minutes"] = metrics_->seconds() / 60;
  provenance_.ended = utc_now();
  keep_provenance();
  write_run_directory_report(run_.path(), true);
  run_.finish();
  return run_.path().string();
}

void StudyRun::choose_method() {
  if (!config_.has("study.method") || config_.text("study.method").empty()) return;
  const std::string& named = config_.text("study.method");
  for (const char* key : {"maps.weights", "light.weights"})
    if (config_.has(key) && !config_.text(key).empty())
      throw usage_error("a method names these weights as well", config_.where(key), config_.text(key),
                        "none beside study.method = " + named);
  method_ = find_method(named, config_.where("study.method"));
  provenance_.facts["method"] = method_->name;
}

fs::path StudyRun::weights_of(const char* key, fs::path Method::*own) const {
  return method_ ? *method_.*own : fs::path(config_.text(key));
}

/// Records of an interrupted run stand, if it was made with what is here now.
void StudyRun::go_on() {
  records_ = read_metrics(run_.metrics_path());
  const fs::path provenance = run_ / "provenance.json";
  if (!records_.empty() && fs::exists(provenance)) earlier_ = read_provenance(provenance);
  const auto as_begun = [&](const char* what, const std::string& now, const std::string& then) {
    if (now != then)
      throw usage_error(fmt::format("this run was begun with another {}", what), run_.path().string(), now,
                        then + ", or a new run.variant");
  };
  if (earlier_) {
    if (earlier_->hashes.contains("kernels"))
      as_begun("hash of kernels", provenance_.hashes["kernels"], earlier_->hashes["kernels"]);
    as_begun("device", provenance_.device, earlier_->device);  // seconds of both would be one table's
    provenance_.hashes.merge(earlier_->hashes);
  }
  use(rooms_.file);
  if (!rooms_.described.empty()) use(rooms_.described);
  metrics_.emplace(run_.metrics_path());
  remove_tree(run_ / "FAILED");
}

void StudyRun::use(const fs::path& file) {
  const FileRecord record = record_file(file);
  const auto same_path = [&](const FileRecord& other) { return other.path == record.path; };
  if (std::ranges::any_of(provenance_.inputs, same_path)) return;
  if (earlier_) {
    const auto before = std::ranges::find_if(earlier_->inputs, same_path);
    if (before != earlier_->inputs.end() && before->hash != record.hash)
      throw usage_error("this run was begun with other contents of this file", record.path, record.hash,
                        before->hash + ", or a new run.variant");
  }
  provenance_.inputs.push_back(record);
}

void StudyRun::use_light(RenderSettings& settings) {
  const fs::path weights = weights_of("light.weights", &Method::light_weights);
  if (settings.light == "net") settings.light = light_of(read_light_sizes(light_or_shipped(weights)));
  use_nets(settings, weights);
  if (const double gain = config_.real("light.gain"); gain > 0 && settings.nets && !settings.nets->sizes.li2020) {
    LightNets nets = *settings.nets;
    nets.sizes.out_of_view.gain = gain;
    settings.nets = std::make_shared<LightNets>(nets);
  }
  const std::string who = answerer_text(settings);
  std::string& all = provenance_.facts["light"];
  if (all.find(who) == std::string::npos) all += (all.empty() ? "" : "; ") + who;
}

void StudyRun::use_nets(RenderSettings& settings, const fs::path& weights) {
  load_light_nets(settings, weights, device_);
  if (!settings.nets) return;
  for (const fs::path& file : weights_files(settings.nets->note)) use(file);
}

void StudyRun::use_light_of_two_parts(RenderSettings& settings) {
  use_light(settings);
  if (settings.light != "net")
    throw usage_error("this study takes the light apart into in view and out of view, which this light is not made of",
                      settings.nets->note, settings.light, "weights of zhu");
}

fs::path StudyRun::use_maps() {
  const fs::path file = weights_or_shipped(weights_of("maps.weights", &Method::maps));
  use(file);
  return file;
}

std::optional<Method> StudyRun::use_rival() {
  const std::string& named = config_.text("study.rival");
  if (named.empty()) return lacks("Li et al. 2020 (study.rival)"), std::nullopt;
  const Method rival = find_method(named, config_.where("study.rival"));
  use(rival.maps);
  provenance_.facts["rival"] = rival.name;
  return rival;
}

void StudyRun::use_light_of(const Method& rival, RenderSettings& settings) {
  settings.light = rival.light;
  use_nets(settings, rival.light_weights);
}

void StudyRun::lacks(const std::string& what) {
  std::string& all = provenance_.facts[kLacking];
  if (all.find(what) == std::string::npos) all += (all.empty() ? "" : "; ") + what;
}

std::string StudyRun::lacking() const {
  const auto all = provenance_.facts.find(kLacking);
  return all == provenance_.facts.end() ? "" : " Lacking: " + all->second + ".";
}

/// From here on there may be records: what they rest on is kept beside them.
void StudyRun::record_rooms() {
  provenance_.rooms = {rooms_.setting == Setting::HeldOut ? "held_out" : "training", rooms_.seeds};
  keep_provenance();
}

void StudyRun::keep_provenance() {
  provenance_.hashes.merge(built_kernels());
  write_provenance(run_ / "provenance.json", provenance_);
}

std::vector<RoomDescription> StudyRun::described_rooms() const {
  if (rooms_.described.empty()) return {};
  const RoomFile file = read_room_file(rooms_.described);
  if (file.setting != rooms_.setting)
    throw usage_error("of another setting than the list beside it", rooms_.described.string(),
                      file.setting == Setting::HeldOut ? "held_out" : "training", rooms_.file.string());
  return rooms_of_seeds(file, rooms_.seeds, rooms_.described.string()).rooms;
}

void StudyRun::each_room(const std::function<void(const ListedRoom& room)>& visit) {
  const RoomAssets assets = load_assets(default_assets(), rooms_.setting);
  const std::vector<RoomDescription> described = described_rooms();
  const auto rooms = static_cast<std::int64_t>(rooms_.seeds.size()), done = static_cast<std::int64_t>(records_.size());
  record_rooms();
  Progress progress("study", rooms, "rooms", done);
  for (std::int64_t r = done; r < rooms; ++r) {
    const auto i = static_cast<std::size_t>(r);
    visit({r, rooms_.seeds[i], rooms_.setting, assets, described.empty() ? nullptr : &described[i]});
    progress.advance();
  }
}

GenerateOptions StudyRun::view_options() const {
  GenerateOptions options;
  options.out = run_ / "data", options.rooms.seeds = rooms_.seeds,
  options.rooms.count = static_cast<int>(rooms_.seeds.size()), options.views.count = 1;
  options.rooms.setting = rooms_.setting, options.rooms.from = rooms_.described;
  options.views.width = config_.whole("data.width");
  options.views.height = config_.whole("data.height");
  options.views.spp = config_.whole("data.spp");
  options.light.wanted = false;  // studies ask the tracer itself
  options.rooms.split = "test", options.interrupted = [] { return interrupted(); };
  return options;
}

std::vector<std::filesystem::path> StudyRun::make_views(const GenerateOptions& options) {
  record_rooms();
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
  keep_provenance();  // with the kernels that this record is of
  metrics_->write(record.step, record.values);
  records_.push_back(std::move(record));
}

}  // namespace clerestory
