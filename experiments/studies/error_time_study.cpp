#include "experiments/studies/error_time_study.hpp"

#include <algorithm>
#include <array>

#include "experiments/applications/predict.hpp"
#include "experiments/evaluation/flip.hpp"
#include "experiments/evaluation/radiance_error.hpp"
#include "experiments/studies/error_time_figures.hpp"
#include "experiments/studies/error_time_tables.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "host/stopwatch.hpp"
#include "nets/learned_light.hpp"

namespace clerestory {
namespace {

enum Stream : std::uint64_t { kParts = kPhotographSeed + 1 };

/// Samples by which kernels are built before they are timed: of less than 64, and of more, groups are of another size.
constexpr std::array kBuilding{16, 64};

using References = std::map<std::string, ErrorReference>;  // by what is estimated

/// Fewer samples than batches come at once.
int batches_of(const TimedEstimator& estimator) {
  return estimator.settings.spp % estimator.batches == 0 ? estimator.batches : 1;
}

/// Fixed, for a layer knows not how many rays it will be asked for.
Sharing sharing_of_invert(const RenderSettings& settings, const Scene& scene) {
  const double rays = static_cast<double>(scene.photo.pixels()) * settings.spp;
  return shares_answers(scene, settings, rays) ? Sharing::Always : Sharing::Never;
}

double smape(const Estimate& picture, const Estimate& truth, const std::vector<bool>& used) {
  RadianceErrorSums sums;
  for (std::size_t i = 0; i < picture.size(); ++i)
    if (used[i % used.size()]) sums.add(picture[i], truth[i]);
  return sums.means().smape;
}

/// Mean over the pixels that are used; the others are alike.
double mean_flip(const Estimate& picture, const Estimate& truth, const std::vector<bool>& used, int width) {
  const auto image = [&](const Estimate& values) {
    Image shown(width, static_cast<int>(used.size()) / width, 3);
    for (std::size_t i = 0; i < values.size(); ++i)
      shown.data[i] = used[i % used.size()] ? static_cast<float>(values[i]) : 0;
    return shown;
  };
  const Image map = flip(image(truth), image(picture));
  std::vector<double> seen;
  for (std::size_t p = 0; p < used.size(); ++p)
    if (used[p]) seen.push_back(map.data[p]);
  return mean(seen);
}

class ErrorTimeStudy : public RoomStudy {
 public:
  ErrorTimeStudy(const Config& config, const std::vector<std::string>& command, std::vector<ErrorTimePart> parts)
      : RoomStudy(config, command), parts_(std::move(parts)), seeds_(config.integer("study.seeds")) {}

 private:
  void measure() override {
    for (ErrorTimePart& part : parts_) {
      use_light(part.truth.settings);
      for (TimedEstimator& estimator : part.estimators)
        estimator.settings.light = part.truth.settings.light, estimator.settings.nets = part.truth.settings.nets;
    }
    if (std::ranges::any_of(parts_, &ErrorTimePart::against_plain)) maps_ = use_maps();
    measure_rooms([this](const ListedRoom& listed) { return run_room(listed); });
  }

  RoomFindings run_room(const ListedRoom& listed) {
    const Random random(listed.seed);
    const Scene scene = scene_of_room(listed);
    RoomFindings found;
    if (!maps_.empty()) measure_maps(scene, found);
    for (std::size_t p = 0; p < parts_.size(); ++p) measure_part(parts_[p], scene, random.fork(kParts + p), found);
    return found;
  }

  /// What the tracer holds of the room is gone when layers are asked for their memory.
  Scene scene_of_room(const ListedRoom& listed) {
    TracedRoom room = photographed(listed);
    return std::move(room.scene);
  }

  /// What `clerestory invert` does before it renders.
  void measure_maps(const Scene& scene, RoomFindings& found) {
    predict_maps(device_, maps_, scene.photo, {});  // kernels are built
    for (std::int64_t s = 0; s < seeds_; ++s) {
      const Stopwatch watch;
      predict_maps(device_, maps_, scene.photo, {});
      found.add(Finding{"seconds", kMapsRegion}.of(s), watch.seconds());
    }
  }

  void measure_part(const ErrorTimePart& part, const Scene& scene, const Random& random, RoomFindings& found) {
    std::uint64_t stream = 0;
    const References truth = truth_of(part, scene, random.fork(stream));
    for (const TimedEstimator& given : part.estimators) {
      TimedEstimator estimator = given;
      for (const int spp : kBuilding) {
        estimator.settings.spp = spp;
        TimedLayer(device_, scene, estimator.settings, estimator.result).run(0);
      }
      for (const std::int64_t spp : part.spp) {
        estimator = given;
        estimator.settings.spp = static_cast<int>(spp);
        if (part.against_plain) estimator.settings.sharing = sharing_of_invert(estimator.settings, scene);
        measure_row(part, estimator, scene, truth, random.fork(++stream), found);
      }
    }
  }

  References truth_of(const ErrorTimePart& part, const Scene& scene, const Random& random) {
    RenderSettings settings = part.truth.settings;
    settings.spp = part.truth_spp / part.truth_runs;
    TimedLayer layer(device_, scene, settings, part.truth.result, truth_precision(part, device_));
    std::map<std::string, std::vector<Estimate>> runs;
    for (int k = 0; k < part.truth_runs; ++k) {
      stop_if_interrupted("study");
      layer.run(random.seed(static_cast<std::uint64_t>(k)));
      for (auto& [what, values] : layer.values()) runs[what].push_back(std::move(values));
    }
    References truth;
    for (const auto& [what, estimates] : runs)
      truth.emplace(what, ErrorReference(estimates, pixels_with_depth(scene), part.floor));
    return truth;
  }

  void measure_row(const ErrorTimePart& part, const TimedEstimator& estimator, const Scene& scene,
                   const References& truth, const Random& random, RoomFindings& found) {
    const int batches = batches_of(estimator);
    TimedLayer layer(device_, scene, estimator.settings, estimator.result, Precision::Single, batches);
    std::map<std::string, std::vector<Estimate>> estimates;
    Finding of{"", part.name, estimator.name, std::to_string(estimator.settings.spp)};
    const auto note = [&](const char* metric, double value, std::int64_t seed = 0) {
      of.metric = metric;
      found.add(of.of(seed), value);
    };
    for (std::int64_t s = 0; s < seeds_; ++s) {
      stop_if_interrupted("study");
      of.region = part.name;
      note("seconds", layer.run(random.seed(static_cast<std::uint64_t>(s))), s);
      for (auto& [what, values] : layer.values()) {
        of.region = region_of(part, what);
        note("error", truth.at(what).error(values), s);
        if (part.floor) {
          const Estimate& mean = truth.at(what).mean();
          note("smape", smape(values, mean, pixels_with_depth(scene)), s);
          note("flip", mean_flip(values, mean, pixels_with_depth(scene), scene.width()), s);
        }
        estimates[what].push_back(std::move(values));
      }
      if (batches == 1) continue;
      for (const auto& [what, errors] : layer.standard_errors())
        of.region = region_of(part, what), note("stated", truth.at(what).stated(errors), s);
    }
    of.region = part.name;
    note("memory", static_cast<double>(layer.memory()) / 0x1p20);
    for (const auto& [what, of_seeds] : estimates) {
      const ErrorReference::Moments moments = truth.at(what).moments(of_seeds);
      of.region = region_of(part, what);
      note("bias", moments.bias), note("bias spread", moments.bias_spread), note("variance", moments.variance);
      note("shift", moments.shift), note("shift spread", moments.shift_spread);
      note("truth spread", moments.truth_spread);
    }
  }

  void conclude() override {
    const ErrorTimeTables made(config_, parts_, found(), device_);
    for (const auto& [name, table] : made.tables()) {
      write_table(name, table);
      write_file(run_.artifact(name + ".csv"), table_csv(table));
    }
    for (const auto& [name, plot] : made.plots()) write_plot(run_.artifact(name + ".svg"), plot);
  }

  std::vector<ErrorTimePart> parts_;
  std::filesystem::path maps_;  // weights of the nets that predict maps, where their time is asked for
  std::int64_t seeds_;
};

}  // namespace

std::string run_error_time_study(const Config& config, const std::vector<std::string>& command) {
  return ErrorTimeStudy(config, command, error_time_parts(config)).run();
}

}  // namespace clerestory
