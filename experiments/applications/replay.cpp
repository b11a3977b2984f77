#include "experiments/applications/replay.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/applications/render_record.hpp"
#include "experiments/applications/run_folder.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

/// The largest difference of two vectors over the size of the first; nothing where only one is there.
std::optional<double> apart(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size() || a.empty()) return {};
  double size = 0, most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    size = std::max(size, std::abs(a[i])), most = std::max(most, std::abs(a[i] - b[i]));
  return size > 0 ? most / size : most;
}

std::string numbers(const std::vector<double>& values, int digits) {
  std::string text;
  for (const double v : values) text += fmt::format("{}{:.{}g}", text.empty() ? "" : " ", v, digits);
  return text.empty() ? "-" : text;
}

}  // namespace

Replayed replay_of_run(const ReplayOptions& options) {
  const FolderLock lock = lock_run(options.run, LockKind::Read);
  const Scene scene = read_run(options.run);
  Device device = Device::open(options.device);
  if (!device.has_double())
    throw usage_error("this device has no doubles", "--device", device.info().name, "one that has");
  const RenderRecord record = read_render_record(options.run / kRenderRecord, device);
  if (options.x < 0 || options.y < 0 || options.x >= scene.width() || options.y >= scene.height())
    throw usage_error("the pixel lies outside of the picture", "--at", fmt::format("{},{}", options.x, options.y),
                      fmt::format("0..{},0..{}", scene.width() - 1, scene.height() - 1));
  int taken = 0, all = 0;
  for (const SampleRound& round : record.rounds) all += round.spp;
  for (const SampleRound& round : record.rounds) {
    if (options.sample < taken || options.sample >= taken + round.spp) {
      taken += round.spp;
      continue;
    }
    RenderSettings settings = record.settings;
    settings.spp = round.spp, settings.seed = round.seed;
    Replayed replayed{round.seed, round.spp, options.sample - taken, {}, {}};
    const int pixel = options.y * scene.width() + options.x;
    replayed.in_double = replay(device, scene, settings, pixel, replayed.of_round, Precision::Double);
    replayed.in_float = replay(device, scene, settings, pixel, replayed.of_round, Precision::Single);
    for (std::vector<Quantity>* quantities : {&replayed.in_double, &replayed.in_float})  // of a round: to the whole
      for (double& share : quantities->back().values) share *= static_cast<double>(round.spp) / all;
    return replayed;
  }
  throw usage_error("the run has no such sample", "--sample", std::to_string(options.sample),
                    fmt::format("0 to {}", taken - 1));
}

std::string replay_text(const Replayed& r) {
  std::string text = fmt::format("sample {} of {}, seed {}\n{:24} {:52} {:40} {}\n", r.of_round, r.spp, r.seed,
                                 "quantity", "double", "float", "apart");
  for (std::size_t i = 0; i < r.in_double.size(); ++i) {
    const Quantity &exact = r.in_double[i], &single = r.in_float[i];
    const std::optional<double> difference = apart(exact.values, single.values);
    text += fmt::format("{:24} {:52} {:40} {}\n", exact.name, numbers(exact.values, 12), numbers(single.values, 9),
                        difference ? fmt::format("{:.1e}", *difference) : "-");
  }
  return text;
}

std::string replay_json(const Replayed& r) {
  nlohmann::ordered_json json{{"seed", r.seed}, {"sample", r.of_round}, {"spp", r.spp}};
  for (std::size_t i = 0; i < r.in_double.size(); ++i)
    json["quantities"].push_back(
        {{"name", r.in_double[i].name}, {"double", r.in_double[i].values}, {"float", r.in_float[i].values}});
  return json.dump(2);
}

}  // namespace clerestory
