// MGNet as a task of the trainer.
#include "experiments/training/report.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/validation.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

class MapsTask : public TrainingTask {
 public:
  MapsTask(Device device, const TrainingOptions& options, std::shared_ptr<States> states)
      : options_(options),
        store_(name_views(options.train_roots, options.train_split), options.size.width, options.size.height,
               options.cache_bytes),
        validation_store_(name_views(options.validation_roots, options.validation_split), options.size.width,
                          options.size.height, 0),
        network_(device, options, states),
        predictor_(device, options.net, states, std::min(8, options.batch), options.gemm),
        device_name_(device.info().name) {}

  std::string net() const override { return net_text(options_.net); }
  std::map<std::string, Shape> weights() const override { return inference_states(options_.net); }
  const std::vector<ViewName>& views() const override { return store_.names(); }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{fmt::format(
        "MGNet {}: {:.2f} M parameters, {} MiB on {}; {} training views, {} for validation, {}x{}, batch {}",
        options_.preset, static_cast<double>(network_.parameters()) * 1e-6, network_.bytes() >> 20, device_name_,
        store_.size(), validation_store_.size(), options_.size.width, options_.size.height, options_.batch)};
    if (options_.w_perceptual == 0)
      notes.push_back("the perceptual term is off: no ImageNet weights of VGG16 were given (loss.perceptual_weights)");
    if (const std::string note = frozen_note(network_.frozen()); !note.empty()) notes.push_back(note);
    return notes;
  }

  std::vector<LeftOut> left_out() const override {
    if (options_.w_perceptual > 0) return {};
    return {{"perceptual loss", "no ImageNet weights of VGG16 were given", ""}};
  }

  void begin(TrainingProgress& progress) override {
    if (!progress.means) progress.means = mean_maps();
    const MapSet means = progress.means->maps(options_.size.width, options_.size.height);
    const auto which = spread(validation_store_.size(), static_cast<std::size_t>(options_.validation_views));
    judged_ = read_for_judgement(validation_store_, which, &means);
    stream_ = batch_stream(store_, options_.augmentation, options_.seed, progress.history.views_seen_before(),
                           options_.batch, progress.step);
  }

  Losses step(double rate) override {
    const TrainingBatch batch = stream_->next();
    last_views_ = batch.views;
    return network_.step(batch, rate);
  }

  std::vector<std::string> last_views() const override { return last_views_; }

  Judgement judge() override {
    judge_all(judged_, predictor_);
    const EvaluationSummary& summary = summary_.emplace(summarise(results_of(judged_)));
    Judgement judgement{history_point(summary), {{"val/score", summary.score()}}, {}};
    judgement.text = fmt::format("score {:.3f};", summary.score());
    for (const MetricSummary& m : summary.metrics) {
      judgement.values.emplace_back(std::string("val/") + info(m.error).key, m.ours.mean);
      judgement.values.emplace_back(std::string("val/ratio/") + info(m.error).name, m.ratio);
      judgement.text += fmt::format(" {} {:.4g} ({:.2f})", info(m.error).name, m.ours.mean, m.ratio);
    }
    judgement.values.emplace_back("val/scale_error", summary.median_log_scale_error);
    judgement.text += fmt::format("; scale {:.2f}", summary.median_log_scale_error);
    return judgement;
  }

  void report(const RunDirectory& run, const Config& config, const History& history,
              const Provenance& provenance) override {
    if (!summary_) judge();  // killed between the last checkpoint and here
    const std::vector<std::string> conventions = evaluation_conventions(options_.size.width, options_.size.height);
    write_training_report(
        run, config, history,
        {summary_table(*summary_, "Validation views"), fmt::format("{}", fmt::join(conventions, "\n")),
         [this](HtmlReport& page) { add_samples(page, samples()); }},
        provenance);
  }

 private:
  MeanMaps mean_maps() {
    MeanMaps means;
    const auto which = spread(store_.size(), static_cast<std::size_t>(options_.mean_views));
    Progress bar("training mean", static_cast<std::int64_t>(which.size()), "views");
    for (const std::size_t i : which) {
      means.add(store_.get(i));
      bar.advance();
      stop_if_interrupted("before the first step: the same command begins again");
    }
    return means.as_stored();
  }

  /// A few validation views with the maps that the net sees in them.
  std::vector<ReportSample> samples() {
    std::vector<ReportSample> samples;
    for (const std::size_t i : spread(judged_.size(), std::min<std::size_t>(3, judged_.size()))) {
      const MapPrediction prediction = predictor_.predict({&judged_[i].view.image}).front();
      samples.push_back({judged_[i].result.view, judged_[i].view, prediction.maps});
    }
    return samples;
  }

  const TrainingOptions& options_;
  ViewStore store_, validation_store_;
  TrainingNetwork network_;
  MapPredictor predictor_;
  std::string device_name_;
  std::vector<JudgedView> judged_;
  std::optional<EvaluationSummary> summary_;  // of the last validation
  std::unique_ptr<BatchStream> stream_;
  std::vector<std::string> last_views_;
};

}  // namespace

std::unique_ptr<TrainingTask> maps_task(Device device, const TrainingOptions& options, std::shared_ptr<States> states) {
  return std::make_unique<MapsTask>(std::move(device), options, std::move(states));
}

}  // namespace clerestory
