// The light as a task of the trainer.
#include <cmath>
#include <deque>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/keyed.hpp"
#include "experiments/training/light_validation.hpp"
#include "experiments/training/network.hpp"
#include "experiments/training/report.hpp"
#include "experiments/training/streamed_light.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/training_views.hpp"
#include "experiments/training/validation.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/map_predictor.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/report/html.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

// Rays of a validation view, and how many rows of them start from free probes: whatever a net is trained on, all nets
// are judged on the same.
constexpr int kJudgedRows = 64, kJudgedSamples = 64;
constexpr double kJudgedProbeRows = 0.2;
constexpr std::uint64_t kJudgedKey = 0x6a75646765;  // their key: the same in every leg
constexpr std::uint64_t kLightKey = 0x6c69676874;   // purpose of a view's key in a batch
constexpr std::uint64_t kGraphKey = 0x6772617068;   // of what the graph draws for a batch
constexpr std::uint64_t kMapsDraw = 0x6d617073;     // of the draw that says whose maps it has

using LightStream = Prefetch<LightBatch>;

/// The training graph and its states.
struct LightNetwork {
  Graph graph;
  LightTraining training;
  std::unique_ptr<Executor> run;
  long parameters = 0;

  LightNetwork(Device device, const TrainingOptions& o, std::shared_ptr<States> states) {
    training = light_training(graph, o.model.light, o.light.step);
    states->initialise(graph, o.run.seed);
    std::vector<Value> outputs;
    for (const auto& [name, value] : training.losses) outputs.push_back(value);
    outputs.push_back(training.squares);
    for (const Value& p : graph.parameters()) parameters += p.shape().count();
    run = std::make_unique<Executor>(compile(graph, outputs, device, plan_options(o), true), std::move(states));
  }

  StepResult step(const LightBatch& batch, std::int64_t step, double rate) {
    for (const auto& [name, tensor] : batch.feeds) run->feed(name, tensor);
    run->feed("learning_rate", Tensor({}, rate));
    run->feed("step", Tensor({}, static_cast<double>(step + 1)));
    run->run(batch.draws);
    return result_of(*run, training.losses, training.parameters, training.squares);
  }
};

/// All directions from a probe's point, a row of pixels a row of rays.
LightRays panorama_rays(const Probe& probe) {
  LightRays rays;
  for (int y = 0; y < probe_height; ++y)
    for (int x = 0; x < probe_width; ++x) {
      rays.points.push_back(probe.center),
          rays.directions.push_back(panorama_direction(x, y, probe_width, probe_height));
      rays.light.push_back({probe.radiance.at(0, y, x), probe.radiance.at(1, y, x), probe.radiance.at(2, y, x)});
      rays.skip.push_back(-1);
    }
  return rays;
}

Image panorama_of(const std::vector<float>& planar) {
  Image image(probe_width, probe_height, 3);
  image.data = planar;
  return image;
}

Table light_table(const LightSummary& s) {
  Table table;
  table.title = "Incident light on validation views";
  for (const char* name : {"rays", "error", "full", "out of view alone", "photograph", "best constant"})
    table.columns.push_back({name, "", Best::None, 4});
  const auto row = [&](const char* rays, LightSummary::Rays kind, const char* name, double RadianceError::*error) {
    std::vector<Cell> cells{std::string(rays), std::string(name)};
    for (int who = 0; who < light_answerers; ++who) cells.push_back(Measure{s.errors[kind][who].*error});
    table.add(std::move(cells));
  };
  for (const auto& [name, error] :
       {std::pair{"relMSE", &RadianceError::relmse}, std::pair{"log-RGB RMSE", &RadianceError::log_rmse}}) {
    row("that hit", LightSummary::Hits, name, error), row("that miss", LightSummary::Misses, name, error);
    row("all", LightSummary::All, name, error);
  }
  return table;
}

std::vector<std::string> light_conventions() {
  return {
      "Truth: radiance along single rays, from tiles of environment maps and from probes of generated rooms, in the "
      "unit in which the picture's 95th percentile of luminance is 0.9; lamps and windows included.",
      "Errors are means over a view's rays and channels, then over views: relMSE is the mean of d^2 / (truth^2 + "
      "0.01), log-RGB RMSE the root of the mean of ln((y + 0.01) / (truth + 0.01))^2.",
      "Photograph: the pixel that a screen-space ray hits, mixed by u with the mean of pixels that do not emit. Best "
      "constant: of the view and of the rays in question, under the very error.",
      "Maps are true, or with light.maps = predicted or both MGNet's, with its own scale of depth; a view without rays "
      "of a kind does not count there."};
}

/// Depth in the metres that the net believes in, as in use.
MapSet in_metres(MapPrediction predicted) {
  Image& depth = predicted.maps.depth;
  const double metres = std::exp(predicted.log_scale) / scene_scale(depth.data, "predicted depth");
  for (float& z : depth.data) z = static_cast<float>(z * metres);
  return std::move(predicted.maps);
}

/// Of a store: views lie in two where they are seen under true and under predicted maps.
std::uint64_t cache_of(const TrainingOptions& options) {
  return options.light.maps == "both" ? options.data.cache_bytes / 2 : options.data.cache_bytes;
}

class LightTask : public TrainingTask {
 public:
  LightTask(Device device, const TrainingOptions& options, const TrainingStates& states)
      : options_(options),
        store_(fixed_names(options), options.model.size.width, options.model.size.height, cache_of(options)),
        validation_store_(name_views(options.data.validation_roots, options.data.validation_split),
                          options.model.size.width, options.model.size.height, 0),
        network_(device, options, states.trained),
        predictor_(device, options.model.light, options.model.size.width, options.model.size.height, kJudgedRows,
                   kJudgedSamples, states.judged),
        panorama_(device, options.model.light, options.model.size.width, options.model.size.height, probe_height,
                  probe_width, states.judged),
        device_(device) {
    for (const JudgingList& list : options.data.lists)
      lists_.emplace_back(list.name, all_views(list.folder), options.model.size);
    check_not_streamed(options.data.stream, validation_store_.names());
    for (const LightList& list : lists_) check_not_streamed(options.data.stream, list.store.names());
  }

  std::string net() const override { return light_text(options_.model.light); }
  std::map<std::string, Shape> weights() const override { return light_states(options_.model.light); }
  const std::vector<ViewName>& views() const override { return store_.names(); }
  TrainingData data(std::int64_t step) const override { return data_of(options_, store_.names(), step); }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{fmt::format(
        "light {}: {:.2f} M parameters, {} MiB on {}; {}, {} for validation, {}x{}, batch {}, {} x {} rays a "
        "view",
        options_.model.preset, static_cast<double>(network_.parameters) * 1e-6, network_.run->bytes() >> 20,
        device_.info().name, data_text(options_, store_.size()), validation_store_.size(), options_.model.size.width,
        options_.model.size.height, options_.train.batch, options_.light.step.rows, options_.light.step.samples)};
    if (const std::string note = frozen_note(network_.training.frozen); !note.empty()) notes.push_back(note);
    return notes;
  }

  std::vector<LeftOut> left_out() const override {
    if (options_.light.step.weights.rerender > 0) return {};
    return {{"pictures rendered again", "loss.rerender is 0", ""}};
  }

  std::optional<std::filesystem::path> maps_weights() const override {
    if (options_.light.maps == "true") return std::nullopt;
    return weights_or_shipped(options_.light.maps_weights);
  }

  void begin(TrainingProgress& progress) override {
    if (options_.light.maps != "true") predict_maps();
    step_ = progress.step, first_ = progress.history.views_seen_before();
    moment_steps_ = progress.moment_steps;
    if (store_.size() > 0) order_.emplace(store_.size(), options_.run.seed);
    if (options_.data.stream.on)
      streamed_.emplace(options_.data.stream, options_.model.size, options_.run.seed,
                        static_cast<std::uint64_t>(first_ + step_ * options_.train.batch), predict_for_stream());
    judged_ = read_judged(validation_store_, options_.data.validation_views);
    for (LightList& list : lists_) list.views = read_judged(list.store, options_.data.list_views);
    stream_ = std::make_unique<LightStream>([this](std::int64_t step) { return batch(step); }, progress.step);
  }

  StepResult step(double rate) override {
    const LightBatch batch = stream_->next();
    last_views_ = batch.views;
    return network_.step(batch, moment_steps_ + step_++, rate);
  }

  std::vector<std::string> last_views() const override { return last_views_; }
  void end() override { stream_.reset(), streamed_.reset(); }

  Judgement judge() override {
    const std::vector<LightSummary> each = judge_each_light(judged_, predictor_);
    const LightSummary& summary = summary_.emplace(mean_of(each));
    Judgement judgement{summary.point(), {}, {}};
    judgement.views.push_back({kValidationList, errors_by_view(judged_, each)});
    judgement.values.emplace_back("val/score", judgement.point.score);
    judgement.text = fmt::format("score {:.3f};", judgement.point.score);
    const std::vector<ErrorName>& names = error_names("light");
    for (std::size_t i = 0; i < names.size(); ++i) {
      judgement.values.emplace_back("val/" + names[i].key, judgement.point.errors[i]);
      judgement.values.emplace_back("val/ratio/" + names[i].key, judgement.point.ratios[i]);
      judgement.text +=
          fmt::format(" {} {:.4g} ({:.2f})", names[i].key, judgement.point.errors[i], judgement.point.ratios[i]);
    }
    for (const LightList& list : lists_) {
      const std::vector<LightSummary> of_list = judge_each_light(list.views, predictor_);
      add_list(judgement, list.name, list.views.size(), mean_of(of_list).point());
      judgement.views.push_back({list.name, errors_by_view(list.views, of_list)});
    }
    return judgement;
  }

  void report(const RunDirectory& run, const Config& config, const History& history,
              const Provenance& provenance) override {
    if (!summary_) judge();  // killed between the last checkpoint and here
    write_training_report(run, config, history,
                          {light_table(*summary_), fmt::format("{}", fmt::join(light_conventions(), "\n")),
                           [this](HtmlReport& page) { add_probes(page); }},
                          provenance);
  }

 private:
  struct LightList {
    std::string name;
    LightStore store;
    std::vector<JudgedLight> views;
    LightList(std::string its_name, std::vector<ViewName> names, const Size& size)
        : name(std::move(its_name)), store(std::move(names), size.width, size.height, 0) {}
  };

  static std::vector<JudgedErrors> errors_by_view(const std::vector<JudgedLight>& views,
                                                  const std::vector<LightSummary>& each) {
    std::vector<JudgedErrors> all;
    for (std::size_t i = 0; i < views.size(); ++i) all.push_back(judged_errors(views[i].name, each[i].point().errors));
    return all;
  }

  std::vector<JudgedLight> read_judged(LightStore& store, int views) const {
    std::vector<JudgedLight> judged;
    for (const std::size_t i : spread(store.size(), static_cast<std::size_t>(views))) {
      const auto view = store.get(i);
      judged.push_back({store.name(i).text(), view,
                        draw_rays(*view, kJudgedRows, kJudgedSamples, kJudgedProbeRows, kJudgedKey + i)});
    }
    return judged;
  }

  /// The second phase of progressive training: MGNet is frozen, and the light's nets learn to live with its errors; of
  /// `both` every other view, by its key, has true maps still.
  void predict_maps() {
    const bool both = options_.light.maps == "both";
    if (both)
      predicted_.emplace(store_.names(), options_.model.size.width, options_.model.size.height, cache_of(options_));
    const LoadedWeights weights = load_weights(*maps_weights(), device_);
    MapPredictor predictor(device_, weights.net, weights.states, 1);
    std::vector<LightStore*> stores{both ? &*predicted_ : &store_, &validation_store_};
    for (LightList& list : lists_) stores.push_back(&list.store);
    std::size_t views = 0;
    for (const LightStore* store : stores) views += store->size();
    Progress bar("maps", static_cast<std::int64_t>(views), "views");
    for (LightStore* store : stores) {
      const bool learned_from = store == stores.front();
      store->predict(
          [&](const Image& picture) {
            stop_if_interrupted("train");
            bar.advance();
            return in_metres(predictor.predict({&picture})[0]);
          },
          learned_from ? DepthUnit::True : DepthUnit::Predicted);
    }
  }

  NamedLightView view_at(std::uint64_t position, bool predicted) {
    if (streamed_ && !is_fixed(options_.data.stream, options_.run.seed, position))
      return streamed_->at(position, predicted);
    const std::size_t view = order_->at(position);
    return {store_.name(view).text(), (predicted && predicted_ ? *predicted_ : store_).get(view)};
  }

  /// MGNet on a queue of its own, for the thread that makes batches.
  StreamedLight::Predict predict_for_stream() const {
    if (options_.light.maps == "true") return {};
    Device device = Device::open(options_.run.device);
    device.use_gemm(options_.model.gemm);
    const LoadedWeights weights = load_weights(*maps_weights(), device);
    const auto predictor = std::make_shared<MapPredictor>(device, weights.net, weights.states, 1);
    return [predictor](const Image& picture) { return predictor->predict({&picture})[0].maps; };
  }

  LightBatch batch(std::int64_t step) {
    std::vector<std::shared_ptr<const LightView>> views;
    std::vector<std::uint64_t> keys;
    std::vector<std::string> names;
    for (int k = 0; k < options_.train.batch; ++k) {
      const auto position = static_cast<std::uint64_t>(first_ + step * options_.train.batch + k);
      const std::uint64_t key = keyed_bits(options_.run.seed, position, kLightKey);
      const bool both = options_.light.maps == "both";
      const bool predicted = both ? keyed_uniform(key, 0, kMapsDraw) < 0.5 : options_.light.maps == "predicted";
      const NamedLightView seen = view_at(position, predicted);
      views.push_back(seen.view), names.push_back(seen.name), keys.push_back(key);
    }
    LightBatch batch = light_batch(views, options_.light.step, options_.light.sampling, keys);
    batch.views = std::move(names);
    const auto at = static_cast<std::uint64_t>(first_ + step * options_.train.batch);
    batch.draws = static_cast<std::uint32_t>(keyed_bits(options_.run.seed, at, kGraphKey));
    return batch;
  }

  /// A few probes: the truth, both parts mixed, the photograph's answer.
  void add_probes(HtmlReport& page) {
    page.section("Probes",
                 "Incident light at free points of validation rooms: the truth, the nets' answer, the "
                 "photograph's own (its pixel at hits, its mean elsewhere).");
    int shown = 0;
    for (const JudgedLight& v : judged_) {
      if (v.view->probes.empty() || shown == 3) continue;
      ++shown;
      const Probe& probe = v.view->probes[0];
      const LightAnswers answers = panorama_.answer(*v.view, panorama_rays(probe));
      page.pictures(
          {picture_of("picture", show_radiance(v.view->image)), picture_of("truth", show_radiance(probe.radiance)),
           picture_of("nets", show_radiance(panorama_of(answers.full))),
           picture_of("photograph", show_radiance(panorama_of(answers.photograph)))},
          room_and_view(v.name));
    }
  }

  const TrainingOptions& options_;
  LightStore store_, validation_store_;
  std::optional<LightStore> predicted_;  // the views of store_ again, under light.maps = both
  std::optional<ViewOrder> order_;       // of store_, where it has any
  std::optional<StreamedLight> streamed_;
  LightNetwork network_;
  LightPredictor predictor_, panorama_;
  Device device_;
  std::vector<JudgedLight> judged_;
  std::deque<LightList> lists_;          // a store does not move
  std::optional<LightSummary> summary_;  // of the last validation
  std::int64_t step_ = 0, first_ = 0;    // of this leg; views that earlier legs saw
  std::int64_t moment_steps_ = 0;        // Adam's steps before this leg
  std::vector<std::string> last_views_;
  std::unique_ptr<LightStream> stream_;  // last: its thread uses the above
};

}  // namespace

std::unique_ptr<TrainingTask> light_task(Device device, const TrainingOptions& options, const TrainingStates& states) {
  return std::make_unique<LightTask>(std::move(device), options, states);
}

}  // namespace clerestory
