#include "experiments/training/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/earlier_try.hpp"
#include "experiments/training/network.hpp"
#include "experiments/training/task.hpp"
#include "experiments/weights/imported.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/stored_states.hpp"
#include "experiments/weights/weights.hpp"
#include "host/cl/tile.hpp"
#include "host/error.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "host/stopwatch.hpp"
#include "host/tuning/tuning.hpp"

namespace clerestory {
namespace {

/// Keys of a config that are not at their default, for the model card.
std::vector<std::string> settings_of(const Config& config) {
  const Config defaults(config.schema());
  std::vector<std::string> settings;
  for (const auto& [key, entry] : config.entries()) {
    if (key.starts_with("run.") || key.starts_with("log.") || config.schema().find(key) == nullptr) continue;
    const auto found = defaults.entries().find(key);
    if (found != defaults.entries().end() && found->second.value == entry.value) continue;
    if (key.starts_with("data.train") || key.starts_with("data.validation") || key == "data.lists" ||
        key == "data.frames" || key == "model.init" || key == "light.maps_weights" ||
        key == "loss.perceptual_weights" || key == "train.memory_mib")
      continue;  // paths and limits of one machine
    if (key.starts_with("finetune.") && std::holds_alternative<std::string>(entry.value)) {  // of its path the name
      const std::filesystem::path path = std::get<std::string>(entry.value);
      settings.push_back(key + "=" + toml_text((path.has_filename() ? path : path.parent_path()).filename().string()));
      continue;
    }
    settings.push_back(key + "=" + toml_value(entry.value));
  }
  return settings;
}

struct WholeCheckpoint {
  std::string path;
  TensorFile file;
};

class Trainer {
 public:
  Trainer(const Config& config, const std::vector<std::string>& command)
      : options_(training_options(config)),
        config_(config),
        run_(options_.run.root, options_.run.experiment, options_.run.variant, config, options_.run.seed),
        before_(run_),
        command_(command) {}

  TrainingOutcome run();

 private:
  /// After the device failed: states lie on it, so that what was done since the last checkpoint is lost with it.
  void say_what_stays() const;
  void prepare();
  /// The newest checkpoint that is whole; newer ones are set aside, which is said. Empty when the run has none yet.
  /// Throws usage_error when it had some and none is whole.
  std::optional<WholeCheckpoint> whole_checkpoint() const;
  /// Keeps a damaged file under another name, and says so.
  void set_aside(const std::filesystem::path& file, const Error& damage) const;
  /// The best weights so far are a file beside the checkpoint. Where it is damaged or gone, which is said, the best
  /// from here on is kept: the run must not end in weights that nobody can read.
  void check_best();
  void resume_or_begin();
  /// Files of weights that this run starts from, and that its loss looks through.
  std::vector<std::filesystem::path> frozen_weights() const;
  /// The file of an encoder alone that a leg starts from: an imported one, or lite's; empty where there is none.
  std::filesystem::path encoder_to_begin_with() const;
  /// After those of `earlier`; `init` is the file or folder that it starts from.
  void begin_leg(const History& earlier, const std::filesystem::path& init);
  void loop();
  void take_step();
  /// Throws where a parameter was not finite before this step, or a loss or gradient in it.
  void stop_if_not_finite(const StepResult& result) const;
  void log_losses();
  /// Throws where the loss of the last line of metrics is train.runaway times that of the best line before.
  void stop_if_run_away(double loss);
  /// What a training ends with that does not converge any more; `checkpoint` is the last good one.
  Error diverged(const std::string& what, const std::string& found, const std::filesystem::path& checkpoint) const;
  std::filesystem::path newest_checkpoint() const {
    const auto newest = run_.latest_checkpoint();
    return newest ? newest->path : std::filesystem::path();
  }
  void validate();
  void checkpoint();
  void keep_provenance();
  void finish();
  /// Of this process's work, in seconds. On a CPU its processor time over the cores, so that others who work beside a
  /// leg, and its being stopped for them, neither shorten it nor make it worth more; wall time elsewhere.
  double work_clock() const { return cores_ > 0 ? processor_seconds() / cores_ : clock_seconds(); }
  double seconds() const { return progress_.seconds + (work_clock() - started_); }
  bool due(std::int64_t every) const { return every > 0 && progress_.step % every == 0; }
  Leg& leg() { return progress_.history.legs.back(); }
  void update_leg();
  RunIdentity identity() const {
    return {options_.model.preset, task_->net(),         options_.model.size,
            options_.run.seed,     config_hash(config_), views_hash(task_->views())};
  }
  /// `work` that reads states; where one is not finite, throws it as diverged.
  void with_finite_states(const std::function<void()>& work) const;
  void save_weights(const std::string& artifact) const {
    update_judged(states_, task_->weights());
    with_finite_states([&] {
      write_weights(
          run_.artifact(artifact), *states_.judged, progress_.history, progress_.means,
          {options_.model.preset, task_->net(), options_.model.size, this_build().commit, task_->weights(),
           joined(factored_moments(*states_.trained, progress_.moment_steps + progress_.step), progress_.kept)});
    });
  }

  TrainingOptions options_;
  const Config& config_;
  RunDirectory run_;
  EarlierTry before_;
  std::vector<std::string> command_;
  Provenance provenance_;
  TrainingStates states_;
  std::unique_ptr<TrainingTask> task_;
  std::unique_ptr<MetricsWriter> metrics_;
  LegLimits limits_;
  TrainingProgress progress_;
  int cores_ = 0;               // of a CPU
  double started_ = 0;          // work_clock() when progress_.seconds was true
  double last_checkpoint_ = 0;  // clock
  double rate_ = 0, log_clock_ = 0;
  double least_loss_ = std::numeric_limits<double>::infinity();  // of the lines of metrics so far
  /// The newest when the loss was last seen not run away: what a step made of the weights shows in later ones alone.
  std::filesystem::path good_checkpoint_;
  std::int64_t log_step_ = 0;
  std::vector<std::string> loss_names_;
  std::string score_note_;
};

TrainingOutcome Trainer::run() {
  const TrainingOutcome outcome{run_.path(), run_.artifact("weights.safetensors"), run_.done()};
  if (outcome.skipped) {
    before_.check_weights(frozen_weights());
    say(fmt::format("{} is finished; nothing to do", run_.path().string()));
    return outcome;
  }
  try {
    prepare();
    resume_or_begin();
    loop();
    finish();
  } catch (const Error& e) {
    task_.reset();  // no thread makes rooms in the folder any more
    run_.fail(e, run_.resumable());
    if (e.kind() == ErrorKind::Device) say_what_stays();
    throw;
  }
  return outcome;
}

void Trainer::say_what_stays() const {
  const auto newest = run_.latest_checkpoint();
  run_.log(newest ? fmt::format("the device failed after step {}; the same command goes on after step {}",
                                progress_.step, newest->step)
                  : fmt::format("the device failed after step {}, before the first checkpoint; the same command begins "
                                "anew",
                                progress_.step));
}

void Trainer::prepare() {
  catch_interrupts();
  Device device = Device::open(options_.run.device);
  device.use_tile(options_.run.tile == "auto" ? before_.tile(device) : options_.run.tile);
  device.use_gemm(options_.model.gemm);
  cores_ = device.info().cpu ? device.info().compute_units : 0;
  provenance_ = begin_provenance(command_, device.fingerprint());
  provenance_.seeds["run.seed"] = options_.run.seed;
  provenance_.hashes["kernels"] = kernels_hash();
  provenance_.facts[kGemmFact] = device.gemm() == "auto" ? preferred_gemm(device) : device.gemm();
  if (device.info().cpu) provenance_.facts["tile"] = device.tile().name;
  states_.trained = std::make_shared<States>(device);
  states_.judged = options_.train.average > 0 ? std::make_shared<States>(device) : states_.trained;
  options_.data.stream.rooms.out = run_ / "stream";
  task_ = options_.model.kind == "light" ? light_task(device, options_, states_) : maps_task(device, options_, states_);
  const double views = static_cast<double>(task_->views().size());
  limits_ = {options_.train.steps, options_.train.minutes};
  if (options_.train.epochs > 0) {
    const auto steps = static_cast<std::int64_t>(std::ceil(options_.train.epochs * views / options_.train.batch));
    limits_.steps = options_.train.steps > 0 ? std::min(options_.train.steps, steps) : steps;
  }
  if (options_.loss.weights.perceptual > 0 && !options_.loss.perceptual_weights.empty())
    provenance_.inputs.push_back(record_file(options_.loss.perceptual_weights));
  if (!options_.data.finetune.nyu_list.empty())
    provenance_.inputs.push_back(record_file(options_.data.finetune.nyu_list));
  if (const auto maps = task_->maps_weights()) {
    provenance_.inputs.push_back(record_file(*maps));
    provenance_.facts[kMapsFact] = provenance_.inputs.back().hash;
  }
  for (const std::string& note : task_->notes()) run_.log(note);
}

std::optional<WholeCheckpoint> Trainer::whole_checkpoint() const {
  std::string damaged;
  while (const auto newest = run_.latest_checkpoint()) {
    const std::string path = newest->path.string();
    try {
      return WholeCheckpoint{path, read_finite_safetensors(path)};
    } catch (const Error& e) {
      if (e.kind() != ErrorKind::Usage) throw;
      set_aside(path, e);
      damaged += std::string(damaged.empty() ? "" : "; ") + e.what();
    }
  }
  if (!damaged.empty())
    throw usage_error("no checkpoint of this run is whole; they are set aside, the same command begins anew",
                      run_.path().string(), damaged);
  return std::nullopt;
}

void Trainer::set_aside(const std::filesystem::path& file, const Error& damage) const {
  const std::string aside = file.string() + ".damaged";
  std::filesystem::rename(file, aside);
  run_.log(fmt::format("{}; set aside as {}", damage.what(), aside));
}

void Trainer::check_best() {
  const double none = TrainingProgress().best_score;
  if (progress_.best_score == none) return;
  const std::filesystem::path best = run_.artifact("best.safetensors");
  try {
    read_finite_safetensors(best);
  } catch (const Error& e) {
    if (e.kind() != ErrorKind::Usage) throw;
    if (std::filesystem::exists(best)) set_aside(best, e);
    progress_.best_score = none;
    run_.log(fmt::format("{}: the best weights up to step {} are lost; the best from here on are kept", best.string(),
                         progress_.step));
  }
}

void Trainer::resume_or_begin() {
  const auto checkpoint = whole_checkpoint();
  if (checkpoint) {
    if (const auto maps = task_->maps_weights()) before_.check_maps(provenance_, *maps);
    before_.check_weights(frozen_weights());
    before_.hand_on(provenance_);
    progress_ = go_on_from(checkpoint->file, checkpoint->path, *states_.trained, identity());
    if (const std::string changes = before_.note_changes(provenance_, progress_.step); !changes.empty())
      run_.log("goes on otherwise than it began: " + changes);
    run_.log(fmt::format("goes on after step {} ({})", progress_.step, duration_text(progress_.seconds)));
    check_best();
  } else {
    History earlier;
    const std::filesystem::path encoder = encoder_to_begin_with();
    const std::filesystem::path init = encoder.empty() ? std::filesystem::path(options_.model.init) : encoder;
    if (!encoder.empty()) {
      read_encoder_weights(encoder, *states_.trained, task_->weights());
      provenance_.inputs.push_back(record_file(encoder));
      run_.log(fmt::format("the encoder starts from {}", encoder.string()));
    } else if (!options_.model.init.empty()) {
      InitialWeights initial =
          read_initial_weights(options_.model.init, *states_.trained, task_->net(), task_->weights());
      earlier = std::move(initial.history), progress_.moment_steps = initial.moment_steps;
      progress_.kept = std::move(initial.kept);
      // Ratios of all legs are to one answer. Who brings views of his own has a mean of his own.
      if (options_.data.stream.on) progress_.means = std::move(initial.means);
      for (const std::filesystem::path& file : weights_files(options_.model.init))
        provenance_.inputs.push_back(record_file(file));
      run_.log(fmt::format("starts from {} ({:.2f} hours, {} views seen), {}", options_.model.init, earlier.hours(),
                           earlier.views_seen(),
                           initial.moment_steps > 0
                               ? "with the second moments of its gradients"
                               : "without second moments of all parameters: Adam finds them anew"));
      const Size& size = options_.model.size;
      if (const Leg* last = earlier.legs.empty() ? nullptr : &earlier.legs.back();
          last && (last->width != size.width || last->height != size.height))
        run_.log(
            fmt::format("they were trained at {}x{}; this leg's views have {}x{}, and so will pictures that its "
                        "weights are shown (model.width, model.height)",
                        last->width, last->height, size.width, size.height));
    }
    begin_averages(*states_.trained);
    begin_leg(earlier, init);
  }
  run_.resume_at(progress_.step);
  if (!checkpoint) cut_metrics(run_.metrics_path(), -1);  // an earlier try died before its first checkpoint
  keep_provenance();

  for (const double loss : curve_of(read_metrics(run_.metrics_path()), "train/loss").values)
    if (loss > 0) least_loss_ = std::min(least_loss_, loss);

  task_->begin(progress_);
  metrics_ = std::make_unique<MetricsWriter>(run_.metrics_path());
}

std::vector<std::filesystem::path> Trainer::frozen_weights() const {
  std::vector<std::filesystem::path> files;
  if (!options_.model.init.empty()) files = weights_files(options_.model.init);
  if (options_.loss.weights.perceptual > 0 && !options_.loss.perceptual_weights.empty())
    files.push_back(options_.loss.perceptual_weights);
  return files;
}

std::filesystem::path Trainer::encoder_to_begin_with() const {
  const ModelSection& model = options_.model;
  if (model.init.empty())
    return model.kind == "maps" && model.net.lite() && model.encoder == "imagenet" ? imagenet_encoder()
                                                                                   : std::filesystem::path();
  if (std::filesystem::is_directory(model.init) || !is_imported(model.init)) return {};
  const auto* dense = std::get_if<DensenetSize>(&model.net.encoder);
  const bool shown_so =
      model.kind == "light" ? model.light.in_view.trunk.imagenet_input : dense && dense->imagenet_input;
  if (!shown_so)
    throw usage_error("this encoder reads pictures as nets of ImageNet do", model.init, "model.input = plain",
                      "model.input = imagenet");
  return model.init;
}

void Trainer::begin_leg(const History& earlier, const std::filesystem::path& init) {
  progress_.history = earlier;
  Leg leg;
  leg.kind = options_.model.kind;
  leg.experiment = options_.run.experiment, leg.variant = options_.run.variant, leg.config_hash = config_hash(config_);
  leg.commit = this_build().commit + (this_build().dirty ? " (changed)" : ""), leg.started = provenance_.started;
  leg.preset = options_.model.preset, leg.width = options_.model.size.width, leg.height = options_.model.size.height,
  leg.batch = options_.train.batch;
  leg.seed = options_.run.seed;
  // A folder for a light, perhaps with a slash at its end.
  leg.init = (init.has_filename() ? init : init.parent_path()).filename().string();
  leg.overrides = settings_of(config_);
  progress_.history.legs.push_back(std::move(leg));
}

void Trainer::update_leg() {
  Leg& now = leg();
  now.steps = progress_.step;
  now.views_seen = progress_.step * options_.train.batch;
  now.hours = seconds() / 3600;
  const TrainingData data = task_->data(progress_.step);
  now.rooms = data.rooms, now.views = data.views;
}

void Trainer::loop() {
  started_ = work_clock();
  last_checkpoint_ = log_clock_ = clock_seconds();
  log_step_ = progress_.step;
  if (progress_.step == 0) validate();
  const bool by_steps = limits_.steps > 0;
  const std::int64_t total = by_steps ? limits_.steps : static_cast<std::int64_t>(std::ceil(60 * limits_.minutes));
  const auto done = [&] { return by_steps ? progress_.step : std::min(total, static_cast<std::int64_t>(seconds())); };
  Progress bar("train", total, by_steps ? "steps" : "seconds", done());
  while (limits_.fraction(progress_.step, seconds() / 60) < 1) {
    take_step();
    if (due(options_.log.every)) log_losses();
    if (due(options_.log.validate_every)) validate();
    const bool long_ago = options_.log.checkpoint_minutes > 0 &&
                          clock_seconds() - last_checkpoint_ > 60 * options_.log.checkpoint_minutes;
    if (due(options_.log.checkpoint_every) || long_ago) checkpoint();
    bar.update(done(), score_note_);
    if (interrupted()) {
      checkpoint();
      run_.log(fmt::format("interrupted after step {}; the same command goes on", progress_.step));
      stop_if_interrupted(run_.path().string());
    }
  }
  if (leg().curve.empty() || leg().curve.back().step != progress_.step) validate();
  checkpoint();
}

void Trainer::take_step() {
  rate_ = options_.train.rate.at(progress_.step, limits_.fraction(progress_.step, seconds() / 60));
  const StepResult result = task_->step(rate_);
  stop_if_not_finite(result);
  const Losses& losses = result.losses;
  progress_.loss_sums.resize(losses.size(), 0.0), loss_names_.resize(losses.size());
  for (std::size_t i = 0; i < losses.size(); ++i)
    progress_.loss_sums[i] += losses[i].second, loss_names_[i] = losses[i].first;
  ++progress_.summed, ++progress_.step;
}

Error Trainer::diverged(const std::string& what, const std::string& found,
                        const std::filesystem::path& checkpoint) const {
  const std::string last = checkpoint.empty() || !std::filesystem::exists(checkpoint)
                               ? "no checkpoint is known to be good"
                               : fmt::format("the last good checkpoint is {}", checkpoint.string());
  return Error(ErrorKind::Failed, fmt::format("the training diverged: {}; {}", what, last), run_.path().string(), found,
               "a finite number, and a loss that falls: lower train.rate");
}

void Trainer::stop_if_not_finite(const StepResult& result) const {
  for (const ParameterSquares& p : result.parameters)
    if (!std::isfinite(p.value)) {
      const Tensor now = states_.trained->get(p.name);
      const std::string found = not_finite(StoredTensor(stored_shape(now.shape), now.floats()));
      throw diverged(fmt::format("{} is not finite after step {}", p.name, progress_.step),
                     found.empty() ? fmt::format("a sum of squares of {}", p.value) : found, newest_checkpoint());
    }
  const std::int64_t step = progress_.step + 1;
  const auto of_batch = [&](double value) {
    return fmt::format("{} in a batch of {}", value, fmt::join(task_->last_views(), ", "));
  };
  for (const auto& [name, value] : result.losses)
    if (!std::isfinite(value))
      throw diverged(fmt::format("the loss \"{}\" is not finite at step {}", name, step), of_batch(value),
                     newest_checkpoint());
  for (const ParameterSquares& p : result.parameters)
    if (!std::isfinite(p.gradient))
      throw diverged(fmt::format("the gradient of {} is not finite at step {}", p.name, step),
                     of_batch(p.gradient) + ", squared and summed", newest_checkpoint());
}

void Trainer::with_finite_states(const std::function<void()>& work) const {
  try {
    work();
  } catch (const NotFinite& e) {
    throw diverged(fmt::format("{} is not finite after step {}", e.where(), progress_.step), e.found(),
                   newest_checkpoint());
  }
}

void Trainer::stop_if_run_away(double loss) {
  const double most = options_.train.runaway * least_loss_;
  if (options_.train.runaway > 0 && loss > most)
    throw diverged(fmt::format("the loss has run away: over the last {} steps to step {} its mean is more than {} "
                               "(train.runaway) times the least so far, {:.4g}",
                               progress_.summed, progress_.step, options_.train.runaway, least_loss_),
                   fmt::format("{:.4g}", loss), good_checkpoint_);
  if (loss > 0) least_loss_ = std::min(least_loss_, loss);
  good_checkpoint_ = newest_checkpoint();
}

void Trainer::log_losses() {
  std::vector<std::pair<std::string, double>> values;
  for (std::size_t i = 0; i < loss_names_.size(); ++i)
    values.emplace_back("train/" + loss_names_[i], progress_.loss_sums[i] / static_cast<double>(progress_.summed));
  values.emplace_back("train/rate", rate_);
  const double speed =
      static_cast<double>(options_.train.batch * (progress_.step - log_step_)) / (clock_seconds() - log_clock_);
  values.emplace_back("time/views_per_second", speed);
  metrics_->write(progress_.step, values);
  score_note_ = fmt::format("loss {:.4f}, {:.1f} views/s", values[0].second, speed);
  stop_if_run_away(values[0].second);
  progress_.loss_sums.clear(), progress_.summed = 0;
  log_step_ = progress_.step, log_clock_ = clock_seconds();
}

void Trainer::validate() {
  const double before = clock_seconds(), worked = work_clock();
  update_judged(states_, task_->weights());
  with_finite_states([&] {
    for (const auto& [name, shape] : task_->weights()) stored_state(*states_.judged, name);
  });
  Judgement judgement = task_->judge();
  started_ += work_clock() - worked;  // judging is no training, however many lists judge
  metrics_->write(progress_.step, judgement.values);
  write_judged_errors(run_.artifact("views.json"), judgement.views);
  run_.log(fmt::format("step {}: {}", progress_.step, judgement.text));
  update_leg();
  if (!std::isfinite(judgement.point.score) && !leg().curve.empty() && std::isfinite(leg().curve.back().score))
    throw diverged(fmt::format("the validation's score is not finite at step {}", progress_.step), judgement.text,
                   newest_checkpoint());
  judgement.point.step = progress_.step, judgement.point.hours = progress_.history.hours();
  leg().curve.push_back(judgement.point);
  // Step 0 says where a leg starts; an untrained net is no candidate. Of equals the later one has learned more.
  const bool learned = progress_.step > 0 || progress_.history.legs.size() > 1;
  if (learned && judgement.point.score <= progress_.best_score) {
    progress_.best_score = judgement.point.score;
    save_weights("best.safetensors");
  }
  log_clock_ += clock_seconds() - before;  // speed is that of training steps
}

void Trainer::keep_provenance() {
  provenance_.hashes.merge(built_kernels());
  write_provenance(run_ / kProvenanceName, provenance_);
}

void Trainer::checkpoint() {
  update_leg();
  keep_provenance();  // with the kernels that these steps are of
  TrainingProgress now = progress_;
  now.seconds = seconds();
  with_finite_states(
      [&] { write_checkpoint(run_.checkpoint_path(progress_.step), *states_.trained, now, identity()); });
  run_.prune_checkpoints(2);
  last_checkpoint_ = clock_seconds();
}

void Trainer::finish() {
  update_leg();
  const bool best_is_last = !(progress_.best_score < leg().curve.back().score);
  save_weights("last.safetensors");
  const auto chosen = run_.artifact(best_is_last ? "last.safetensors" : "best.safetensors");
  write_file(run_.artifact("weights.safetensors"), read_file(chosen));
  provenance_.ended = utc_now();
  provenance_.figures["seconds"] = seconds();
  provenance_.figures["views_per_second"] = static_cast<double>(progress_.step * options_.train.batch) / seconds();
  provenance_.outputs.push_back(record_file(run_.artifact("weights.safetensors")));
  provenance_.left_out = task_->left_out();
  keep_provenance();
  task_->report(run_, config_, progress_.history, provenance_);
  task_->end();  // rooms are still being made ahead
  remove_tree(options_.data.stream.rooms.out);
  run_.finish();
  const auto weights = run_.artifact("weights.safetensors");
  const std::int64_t step = read_history(weights).legs.back().steps;
  run_.log(fmt::format("{} steps in {}; weights of step {}{} in {}", progress_.step, duration_text(seconds()), step,
                       best_is_last ? ""
                       : step == 0  ? ", with which it began: none was better"
                                    : ", the best validation",
                       weights.string()));
}

}  // namespace

TrainingOutcome train(const Config& config, const std::vector<std::string>& command) {
  return Trainer(config, command).run();
}

}  // namespace clerestory
