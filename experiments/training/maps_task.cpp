// MGNet as a task of the trainer.
#include <cmath>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/keyed.hpp"
#include "experiments/training/network.hpp"
#include "experiments/training/photo.hpp"
#include "experiments/training/report.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/validation.hpp"
#include "experiments/weights/map_predictor.hpp"
#include "experiments/weights/maps_text.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr std::uint64_t kPhotoKey = 0x70686f746f;  // of the cameras through which lists are judged

class MapsTask : public TrainingTask {
 public:
  MapsTask(Device device, const TrainingOptions& options, const TrainingStates& states)
      : options_(options),
        store_(fixed_names(options), options.model.size.width, options.model.size.height, options.data.cache_bytes),
        photographs_(options.data.finetune.on() ? std::make_shared<FinetuneSet>(options.data.finetune) : nullptr),
        names_(names_of(store_, photographs_.get())),
        validation_store_(name_views(options.data.validation_roots, options.data.validation_split),
                          options.model.size.width, options.model.size.height, 0),
        network_(device, options, states.trained),
        predictor_(device, options.model.net, states.judged, std::min(8, options.train.batch)),
        device_name_(device.info().name) {
    check_not_streamed(options.data.stream, validation_store_.names());
    for (const JudgingList& list : options.data.lists) check_not_streamed(options.data.stream, all_views(list.folder));
  }

  std::string net() const override { return net_text(options_.model.net); }
  std::map<std::string, Shape> weights() const override { return maps_states(options_.model.net); }
  const std::vector<ViewName>& views() const override { return names_; }
  TrainingData data(std::int64_t step) const override { return data_of(options_, store_.names(), step); }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{
        fmt::format("MGNet {}: {:.2f} M parameters, {} MiB on {}; {}, {} for validation, {}x{}, batch {}",
                    options_.model.preset, static_cast<double>(network_.parameters()) * 1e-6, network_.bytes() >> 20,
                    device_name_, data_text(options_, store_.size()), validation_store_.size(),
                    options_.model.size.width, options_.model.size.height, options_.train.batch)};
    if (photographs_) notes.push_back(photographs_->text());
    notes.push_back(perceptual_note());
    if (const std::string note = frozen_note(network_.frozen()); !note.empty()) notes.push_back(note);
    return notes;
  }

  std::vector<LeftOut> left_out() const override {
    if (options_.loss.weights.perceptual > 0) return {};
    return {{"perceptual loss", "no features were given (loss.perceptual_features)", ""}};
  }

  void begin(TrainingProgress& progress) override {
    // Before rooms are made: what is named wrongly is said at once.
    const int longer = std::max(options_.model.size.width, options_.model.size.height);
    for (const std::filesystem::path& folder : options_.data.frames) frames_.push_back(read_frame(folder, longer));
    const std::int64_t first = progress.history.views_seen_before();
    const auto position = static_cast<std::uint64_t>(first + progress.step * options_.train.batch);
    views_ = options_.data.stream.on
                 ? streamed_views(options_.data.stream, options_.model.size, &store_, options_.run.seed, position)
                 : fixed_views(store_, options_.run.seed);
    if (photographs_) views_ = finetune_views(std::move(views_), photographs_, options_.model.size, options_.run.seed);
    if (!progress.means) progress.means = mean_maps(position);
    const MapSet means = progress.means->maps(options_.model.size.width, options_.model.size.height);
    const auto which = spread(validation_store_.size(), static_cast<std::size_t>(options_.data.validation_views));
    judged_ = read_for_judgement(validation_store_, which, &means);
    for (const JudgingList& list : options_.data.lists) lists_.push_back({list.name, read_list(list, means)});
    means_ = progress.means, moment_steps_ = progress.moment_steps;
    stream_ = std::make_unique<BatchStream>(*views_, options_.data.augmentation, options_.run.seed, first,
                                            options_.train.batch, progress.step);
  }

  StepResult step(double rate) override {
    TrainingBatch batch = stream_->next();
    batch.step += moment_steps_;
    last_views_ = batch.views;
    return network_.step(batch, rate);
  }

  std::vector<std::string> last_views() const override { return last_views_; }
  void end() override { stream_.reset(), views_.reset(); }

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
    judgement.views.push_back({kValidationList, errors_by_view(judged_)});
    judgement.values.emplace_back("val/scale_error", summary.median_log_scale_error);
    judgement.text += fmt::format("; scale {:.2f}", summary.median_log_scale_error);
    judge_lists(judgement);
    judge_frames(judgement);
    return judgement;
  }

  void report(const RunDirectory& run, const Config& config, const History& history,
              const Provenance& provenance) override {
    if (!summary_) judge();  // killed between the last checkpoint and here
    std::vector<std::string> conventions =
        evaluation_conventions(options_.model.size.width, options_.model.size.height);
    conventions.push_back(kPredictionConvention);
    write_training_report(
        run, config, history,
        {summary_table(*summary_, "Validation views"), fmt::format("{}", fmt::join(conventions, "\n")),
         [this](HtmlReport& page) { add_samples(page, samples()); }},
        provenance);
  }

 private:
  struct MapsList {
    std::string name;
    std::vector<JudgedView> views;
  };

  static std::vector<ViewName> names_of(const ViewStore& rooms, const FinetuneSet* photographs) {
    std::vector<ViewName> names = rooms.names();
    if (!photographs) return names;
    const std::vector<ViewName> more = photographs->names();
    names.insert(names.end(), more.begin(), more.end());
    return names;
  }

  std::string perceptual_note() const {
    using From = PerceptualFeatures::From;
    const LossSection& loss = options_.loss;
    if (loss.weights.perceptual == 0)
      return "the perceptual term is off: no features were given (loss.perceptual_features)";
    if (loss.weights.features.from == From::Random)
      return fmt::format("the perceptual term looks through VGG16 with random weights of seed {}", options_.run.seed);
    return fmt::format("the perceptual term looks through {} of {}",
                       loss.weights.features.from == From::Rooms ? "the encoder" : "VGG16", loss.perceptual_weights);
  }

  std::vector<JudgedView> read_list(const JudgingList& list, const MapSet& means) const {
    ViewStore store(all_views(list.folder), options_.model.size.width, options_.model.size.height, 0);
    const auto which = spread(store.size(), static_cast<std::size_t>(options_.data.list_views));
    std::vector<JudgedView> views = read_for_judgement(store, which, &means);
    for (std::size_t i = 0; list.photographed && i < views.size(); ++i)
      views[i].view.image = as_photographed(views[i].view.image, keyed_bits(kPhotoKey, which[i], 0));
    return views;
  }

  static std::vector<JudgedErrors> errors_by_view(const std::vector<JudgedView>& views) {
    std::vector<JudgedErrors> all;
    for (const ViewResult& r : results_of(views)) {
      std::vector<double> errors;
      for (const auto& error : r.ours) errors.push_back(error.value_or(NAN));
      all.push_back(judged_errors(r.view, std::move(errors)));
    }
    return all;
  }

  void judge_lists(Judgement& judgement) {
    for (MapsList& list : lists_) {
      judge_all(list.views, predictor_);
      add_list(judgement, list.name, list.views.size(), history_point(summarise(results_of(list.views))));
      judgement.views.push_back({list.name, errors_by_view(list.views)});
    }
  }

  void judge_frames(Judgement& judgement) {
    JudgedErrorsList& photographs = judgement.views.emplace_back(JudgedErrorsList{"photographs", {}});
    for (const JudgedFrame& frame : frames_) {
      const FrameResult result = clerestory::judge(frame, predictor_, means_);
      judgement.point.frames.push_back({frame.name, result.ours, result.constant, result.scale});
      judgement.values.emplace_back("frame/" + frame.name, result.ours / result.constant);
      std::vector<double> errors(map_error_count, NAN);
      errors[static_cast<std::size_t>(MapError::Depth)] = result.ours;
      photographs.views.push_back({frame.name, "", std::move(errors)});
      judgement.text += fmt::format("; {} {:.2f}", frame.name, result.ours / result.constant);
    }
  }

  MeanMaps mean_maps(std::uint64_t position) {
    MeanMaps means;
    ViewStore some(views_->some(position, static_cast<std::size_t>(options_.data.mean_views)),
                   options_.model.size.width, options_.model.size.height, 0);
    Progress bar("training mean", static_cast<std::int64_t>(some.size()), "views");
    for (std::size_t i = 0; i < some.size(); ++i) {
      means.add(some.get(i));
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
  ViewStore store_;
  std::shared_ptr<FinetuneSet> photographs_;  // none: all views are of rooms
  std::vector<ViewName> names_;
  ViewStore validation_store_;
  TrainingNetwork network_;
  MapPredictor predictor_;
  std::string device_name_;
  std::vector<JudgedView> judged_;
  std::vector<MapsList> lists_;
  std::vector<JudgedFrame> frames_;
  std::optional<MeanMaps> means_;
  std::int64_t moment_steps_ = 0;             // Adam's steps before this leg
  std::optional<EvaluationSummary> summary_;  // of the last validation
  std::unique_ptr<TrainingViews> views_;
  std::unique_ptr<BatchStream> stream_;  // after what its thread uses
  std::vector<std::string> last_views_;
};

}  // namespace

std::unique_ptr<TrainingTask> maps_task(Device device, const TrainingOptions& options, const TrainingStates& states) {
  return std::make_unique<MapsTask>(std::move(device), options, states);
}

}  // namespace clerestory
