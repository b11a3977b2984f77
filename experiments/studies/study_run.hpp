// What every study has: a config, a run directory that is skipped when done and gone on with when not, a device,
// records.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "experiments/truth/room_list.hpp"
#include "experiments/weights/method.hpp"
#include "host/cl/device.hpp"
#include "host/io/config.hpp"
#include "host/report/metrics.hpp"
#include "host/report/run_directory.hpp"
#include "host/report/table.hpp"
#include "nets/scene_light.hpp"
#include "tracer/generate.hpp"

namespace clerestory {

/// What tables call a method that is judged beside ours.
std::string rival_label(const Method& rival);

class StudyRun {
 public:
  StudyRun(const Config& config, const std::vector<std::string>& command);
  virtual ~StudyRun() = default;

  /// Measures what is missing, writes tables, provenance and report. Returns the run directory.
  std::string run();

 protected:
  /// Adds the records that records_ lacks, to it and to the run's metrics.
  virtual void measure() = 0;
  /// Tables and facts from records_.
  virtual void conclude() = 0;

  /// Calls `visit` for each of the first data.rooms rooms of data.list that has no record yet.
  void each_room(const std::function<void(const ListedRoom& room)>& visit);
  /// Generated rooms of one view each, as the config's section `data` asks.
  GenerateOptions view_options() const;
  std::vector<std::filesystem::path> make_views(const GenerateOptions& options);
  void write_table(const std::string& name, const Table& table) const;  // also to stdout

  /// Whatever file results rest on becomes an input of the provenance, with its hash. Throws ErrorKind::Usage when the
  /// run was begun with another one of that name.
  void use(const std::filesystem::path& file);
  /// Nets of `study.method` or `light.weights` for the settings' learned light, used from now on; settings.light = net
  /// becomes the one that they answer for. Throws what load_light_nets() throws.
  void use_light(RenderSettings& settings);
  /// The same for a study that takes light = net apart. Throws usage_error where it has not two parts.
  void use_light_of_two_parts(RenderSettings& settings);
  /// Weights of the maps by `study.method` or `maps.weights`, used from now on.
  std::filesystem::path use_maps();
  /// The method of `study.rival`, its maps used from now on; nothing, and Li et al. 2020 lacking, where none is named.
  std::optional<Method> use_rival();
  /// Its light for these settings, which becomes the one that its nets answer for, used from now on.
  void use_light_of(const Method& rival, RenderSettings& settings);
  /// Whose nets `study.method` names, for tables.
  std::string own_label() const;
  /// A rival or data that a comparison ought to have: named in the provenance and by lacking().
  void lacks(const std::string& what);
  /// A sentence for a table's note: " Lacking: ...", or nothing.
  std::string lacking() const;

  /// Into the run's metrics, then to records_.
  void add_record(MetricRecord record);

  Config config_;
  RoomList rooms_;
  Device device_;
  RunDirectory run_;
  Provenance provenance_;
  std::vector<MetricRecord> records_;  // of this run, and of those that were interrupted before

 private:
  void go_on();
  void choose_method();
  void use_nets(RenderSettings& settings, const std::filesystem::path& weights);
  /// The weights that the key names, else the method's, else none.
  std::filesystem::path weights_of(const char* key, std::filesystem::path Method::*own) const;
  void record_rooms();
  void keep_provenance();
  /// The rooms of rooms_.described that the run is about, in their order; none where there is no such file.
  std::vector<RoomDescription> described_rooms() const;

  std::optional<Method> method_;          // of study.method
  std::optional<Provenance> earlier_;     // what the interrupted run was made with
  std::optional<MetricsWriter> metrics_;  // keeps the time
};

}  // namespace clerestory
