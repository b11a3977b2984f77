#include "experiments/training/trainer.hpp"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <set>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/report.hpp"
#include "experiments/training/validation.hpp"
#include "host/error.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

double clock_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Keys of a config that are not at their default, for the model card.
std::vector<std::string> settings_of(const Config& config) {
  const Config defaults(config.schema());
  std::vector<std::string> settings;
  for (const auto& [key, entry] : config.entries()) {
    if (key.starts_with("run.") || key.starts_with("log.") || config.schema().find(key) == nullptr) continue;
    const auto found = defaults.entries().find(key);
    if (found != defaults.entries().end() && found->second.value == entry.value) continue;
    if (key.starts_with("data.train") || key.starts_with("data.validation") || key == "model.init")
      continue;  // paths of one machine
    settings.push_back(key + "=" + toml_value(entry.value));
  }
  return settings;
}

class Trainer {
 public:
  Trainer(const Config& config, const std::vector<std::string>& command)
      : options_(training_options(config)),
        config_(config),
        run_(options_.root, options_.experiment, options_.variant, config, options_.seed),
        fresh_(!std::filesystem::exists(run_ / "log.txt")),
        command_(command) {}

  TrainingOutcome run();

 private:
  void prepare();
  void resume_or_begin();
  void begin_leg(const History& earlier);
  void loop();
  void take_step(BatchStream& stream);
  void log_losses();
  void validate();
  const EvaluationSummary& judge_now();
  void checkpoint();
  void finish();
  std::vector<ReportSample> samples();
  double seconds() const { return progress_.seconds + (clock_now() - started_); }
  bool due(std::int64_t every) const { return every > 0 && progress_.step % every == 0; }
  Leg& leg() { return progress_.history.legs.back(); }
  void update_leg();
  RunIdentity identity() const {
    return {options_.preset, options_.net, options_.size, options_.seed, config_hash(config_), views_hash_};
  }
  WeightsFacts facts() const {
    return {options_.preset, options_.net, options_.size, this_build().commit, options_.seed};
  }

  TrainingOptions options_;
  const Config& config_;
  RunDirectory run_;
  bool fresh_;  // nothing was here before
  std::vector<std::string> command_;
  Provenance provenance_;
  std::unique_ptr<ViewStore> store_, validation_store_;
  std::uint64_t views_hash_ = 0;
  std::shared_ptr<States> states_;
  std::unique_ptr<TrainingNetwork> network_;
  std::unique_ptr<MapPredictor> predictor_;
  std::vector<JudgedView> judged_;
  std::optional<EvaluationSummary> summary_;  // of the last validation
  std::unique_ptr<MetricsWriter> metrics_;
  LegLimits limits_;
  TrainingProgress progress_;
  double started_ = 0;          // clock when progress_.seconds was true
  double last_checkpoint_ = 0;  // clock
  double rate_ = 0, log_clock_ = 0;
  std::int64_t log_step_ = 0;
  std::string score_note_;
};

TrainingOutcome Trainer::run() {
  const TrainingOutcome outcome{run_.path(), run_.artifact("weights.safetensors"), run_.done()};
  if (outcome.skipped) {
    say(fmt::format("{} is finished; nothing to do", run_.path().string()));
    return outcome;
  }
  try {
    prepare();
    resume_or_begin();
    loop();
    finish();
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Usage && fresh_ && !run_.resumable())
      std::filesystem::remove_all(run_.path());  // bad input leaves nothing behind
    else if (e.kind() != ErrorKind::Interrupted)
      run_.fail(e.what());
    throw;
  }
  return outcome;
}

void Trainer::prepare() {
  catch_interrupts();
  auto names = name_views(options_.train_roots, options_.train_split);
  views_hash_ = views_hash(names);
  if (options_.epochs > 0) {
    const auto steps =
        static_cast<std::int64_t>(std::ceil(options_.epochs * static_cast<double>(names.size()) / options_.batch));
    limits_.steps = options_.steps > 0 ? std::min(options_.steps, steps) : steps;
  } else {
    limits_.steps = options_.steps;
  }
  limits_.minutes = options_.minutes;
  store_ =
      std::make_unique<ViewStore>(std::move(names), options_.size.width, options_.size.height, options_.cache_bytes);
  validation_store_ = std::make_unique<ViewStore>(name_views(options_.validation_roots, options_.validation_split),
                                                  options_.size.width, options_.size.height, 0);

  Device device = Device::open(options_.device);
  provenance_ = begin_provenance(command_, device.fingerprint());
  provenance_.seeds["run.seed"] = options_.seed;
  states_ = std::make_shared<States>(device);
  network_ = std::make_unique<TrainingNetwork>(device, options_, states_);
  predictor_ =
      std::make_unique<MapPredictor>(device, options_.net, states_, std::min(8, options_.batch), options_.gemm);
  run_.log(fmt::format(
      "MGNet {}: {:.2f} M parameters, {} MiB on {}; {} training views, {} for validation, {}x{}, batch {}",
      options_.preset, static_cast<double>(network_->parameters()) * 1e-6, network_->bytes() >> 20, device.info().name,
      store_->size(), validation_store_->size(), options_.size.width, options_.size.height, options_.batch));
  if (options_.w_perceptual == 0)
    run_.log("the perceptual term is off: no ImageNet weights of VGG16 were given (loss.perceptual_weights)");
}

void Trainer::resume_or_begin() {
  const auto checkpoint = run_.latest_checkpoint();
  if (checkpoint) {
    progress_ = read_checkpoint(checkpoint->path, *states_, identity());
    run_.log(fmt::format("goes on after step {} ({})", progress_.step, duration_text(progress_.seconds)));
  } else {
    History earlier;
    if (!options_.init.empty()) {
      earlier = read_initial_weights(options_.init, *states_, options_.net);
      provenance_.inputs.push_back(record_file(options_.init));
      run_.log(fmt::format("starts from {} ({:.2f} hours, {} views seen)", options_.init, earlier.hours(),
                           earlier.views_seen()));
    }
    begin_leg(earlier);
  }
  run_.resume_at(progress_.step);
  if (!checkpoint) cut_metrics(run_.metrics_path(), -1);  // an earlier try died before its first checkpoint
  write_provenance(run_ / "provenance.json", provenance_);

  if (!progress_.means) {
    MeanMaps means;
    const auto which = spread(store_->size(), static_cast<std::size_t>(options_.mean_views));
    Progress bar("training mean", static_cast<std::int64_t>(which.size()), "views");
    for (const std::size_t i : which) {
      means.add(store_->get(i));
      bar.advance();
      stop_if_interrupted("before the first step: the same command begins again");
    }
    progress_.means = means.as_stored();
  }
  const MapSet means = progress_.means->maps(options_.size.width, options_.size.height);
  judged_ = read_for_judgement(*validation_store_,
                               spread(validation_store_->size(), static_cast<std::size_t>(options_.validation_views)),
                               &means);
  metrics_ = std::make_unique<MetricsWriter>(run_.metrics_path());
}

void Trainer::begin_leg(const History& earlier) {
  progress_.history = earlier;
  Leg leg;
  leg.experiment = options_.experiment, leg.variant = options_.variant, leg.config_hash = config_hash(config_);
  leg.commit = this_build().commit + (this_build().dirty ? " (changed)" : ""), leg.started = provenance_.started;
  leg.preset = options_.preset, leg.width = options_.size.width, leg.height = options_.size.height,
  leg.batch = options_.batch;
  leg.seed = options_.seed, leg.views = static_cast<std::int64_t>(store_->size());
  std::set<std::string> rooms;
  for (const ViewName& name : store_->names()) rooms.insert(name.room.string());
  leg.rooms = static_cast<std::int64_t>(rooms.size());
  leg.init = std::filesystem::path(options_.init).filename().string();
  leg.overrides = settings_of(config_);
  progress_.history.legs.push_back(std::move(leg));
}

void Trainer::update_leg() {
  Leg& now = leg();
  now.steps = progress_.step;
  now.views_seen = progress_.step * options_.batch;
  now.hours = seconds() / 3600;
}

void Trainer::loop() {
  BatchStream stream(*store_, options_.augmentation, options_.seed, options_.batch, progress_.step);
  started_ = last_checkpoint_ = log_clock_ = clock_now();
  log_step_ = progress_.step;
  if (progress_.step == 0) validate();
  const bool by_steps = limits_.steps > 0;
  const std::int64_t total = by_steps ? limits_.steps : static_cast<std::int64_t>(std::ceil(limits_.minutes));
  Progress bar("train", total, by_steps ? "steps" : "minutes",
               by_steps ? progress_.step : static_cast<std::int64_t>(progress_.seconds / 60));
  while (limits_.fraction(progress_.step, seconds() / 60) < 1) {
    take_step(stream);
    if (due(options_.log_every)) log_losses();
    if (due(options_.validate_every)) validate();
    const bool long_ago =
        options_.checkpoint_minutes > 0 && clock_now() - last_checkpoint_ > 60 * options_.checkpoint_minutes;
    if (due(options_.checkpoint_every) || long_ago) checkpoint();
    bar.update(by_steps ? progress_.step : std::min(total, static_cast<std::int64_t>(seconds() / 60)), score_note_);
    if (interrupted()) {
      checkpoint();
      run_.log(fmt::format("interrupted after step {}; the same command goes on", progress_.step));
      stop_if_interrupted(run_.path().string());
    }
  }
  if (leg().curve.empty() || leg().curve.back().step != progress_.step) validate();
  checkpoint();
}

void Trainer::take_step(BatchStream& stream) {
  const TrainingBatch batch = stream.next();
  rate_ = options_.rate.at(progress_.step, limits_.fraction(progress_.step, seconds() / 60));
  const Losses losses = network_->step(batch, rate_);
  for (const auto& [name, value] : losses)
    if (!std::isfinite(value))
      throw Error(
          ErrorKind::Failed,
          fmt::format("the loss \"{}\" is {} at step {}; the last checkpoint stays", name, value, progress_.step + 1),
          run_.path().string(), fmt::format("in a batch of {}", fmt::join(batch.views, ", ")),
          "a finite number: look at these views, or lower train.rate");
  progress_.loss_sums.resize(losses.size(), 0.0);
  for (std::size_t i = 0; i < losses.size(); ++i) progress_.loss_sums[i] += losses[i].second;
  ++progress_.summed, ++progress_.step;
}

void Trainer::log_losses() {
  std::vector<std::pair<std::string, double>> values;
  const auto& names = network_->loss_names();
  for (std::size_t i = 0; i < names.size(); ++i)
    values.emplace_back("train/" + names[i], progress_.loss_sums[i] / static_cast<double>(progress_.summed));
  values.emplace_back("train/rate", rate_);
  const double speed = static_cast<double>(options_.batch * (progress_.step - log_step_)) / (clock_now() - log_clock_);
  values.emplace_back("time/views_per_second", speed);
  metrics_->write(progress_.step, values);
  score_note_ = fmt::format("loss {:.4f}, {:.1f} views/s", values[0].second, speed);
  progress_.loss_sums.clear(), progress_.summed = 0;
  log_step_ = progress_.step, log_clock_ = clock_now();
}

const EvaluationSummary& Trainer::judge_now() {
  judge_all(judged_, *predictor_);
  return summary_.emplace(summarise(results_of(judged_)));
}

void Trainer::validate() {
  const double before = clock_now();
  const EvaluationSummary& summary = judge_now();
  std::vector<std::pair<std::string, double>> values{{"val/score", summary.score()}};
  std::string line = fmt::format("step {}: score {:.3f};", progress_.step, summary.score());
  for (const MetricSummary& m : summary.metrics) {
    values.emplace_back(std::string("val/") + info(m.error).key, m.ours.mean);
    values.emplace_back(std::string("val/ratio/") + info(m.error).name, m.ratio);
    line += fmt::format(" {} {:.4g} ({:.2f})", info(m.error).name, m.ours.mean, m.ratio);
  }
  values.emplace_back("val/scale_error", summary.median_log_scale_error);
  metrics_->write(progress_.step, values);
  run_.log(line + fmt::format("; scale {:.2f}", summary.median_log_scale_error));
  update_leg();
  leg().curve.push_back(history_point(summary, progress_.step, progress_.history.hours()));
  // Step 0 says where a leg starts; an untrained net is no candidate.
  if (progress_.step > 0 && summary.score() < progress_.best_score) {
    progress_.best_score = summary.score();
    write_weights(run_.artifact("best.safetensors"), *states_, progress_.history, progress_.means, facts());
  }
  log_clock_ += clock_now() - before;  // speed is that of training steps
}

void Trainer::checkpoint() {
  update_leg();
  TrainingProgress now = progress_;
  now.seconds = seconds();
  write_checkpoint(run_.checkpoint_path(progress_.step), *states_, now, identity());
  run_.prune_checkpoints(2);
  last_checkpoint_ = clock_now();
}

/// A few validation views with the maps that the net sees in them.
std::vector<ReportSample> Trainer::samples() {
  std::vector<ReportSample> samples;
  for (const std::size_t i : spread(judged_.size(), std::min<std::size_t>(3, judged_.size()))) {
    const MapPrediction prediction = predictor_->predict({&judged_[i].view.image}).front();
    samples.push_back({judged_[i].result.view, judged_[i].view, prediction.maps});
  }
  return samples;
}

void Trainer::finish() {
  update_leg();
  if (!summary_) judge_now();  // killed between the last checkpoint and here
  const bool best_is_last = !(progress_.best_score < leg().curve.back().score);
  write_weights(run_.artifact("last.safetensors"), *states_, progress_.history, progress_.means, facts());
  const auto chosen = run_.artifact(best_is_last ? "last.safetensors" : "best.safetensors");
  write_file(run_.artifact("weights.safetensors"), read_file(chosen));
  provenance_.ended = utc_now();
  provenance_.figures["seconds"] = seconds();
  provenance_.figures["views_per_second"] = static_cast<double>(progress_.step * options_.batch) / seconds();
  provenance_.outputs.push_back(record_file(run_.artifact("weights.safetensors")));
  if (options_.w_perceptual == 0)
    provenance_.left_out.push_back({"perceptual loss", "no ImageNet weights of VGG16 were given", ""});
  write_provenance(run_ / "provenance.json", provenance_);
  write_training_report(run_, config_, progress_.history, *summary_, samples(), provenance_);
  run_.finish();
  run_.log(fmt::format("{} steps in {}; weights of {} in {}", progress_.step, duration_text(seconds()),
                       best_is_last ? "the last step" : "the best validation",
                       run_.artifact("weights.safetensors").string()));
}

}  // namespace

TrainingOutcome train(const Config& config, const std::vector<std::string>& command) {
  return Trainer(config, command).run();
}

}  // namespace clerestory
