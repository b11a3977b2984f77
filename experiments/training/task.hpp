// What is trained. The trainer knows legs, steps, rates and files; a task knows the net, its data and what is good.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "experiments/training/averages.hpp"
#include "experiments/training/checkpoint.hpp"
#include "experiments/training/judged_views.hpp"
#include "experiments/training/network.hpp"
#include "host/report/run_directory.hpp"

namespace clerestory {

/// What a validation found.
struct Judgement {
  HistoryPoint point;                                  // step and hours are the trainer's
  std::vector<std::pair<std::string, double>> values;  // for metrics.jsonl
  std::string text;                                    // for the log
  std::vector<JudgedErrorsList> views = {};            // of the validation rooms, then of each fixed list
};

/// Beside the validation what was found on a fixed list.
void add_list(Judgement& judgement, const std::string& list, std::size_t views, const HistoryPoint& point);

struct TrainingData {
  std::int64_t rooms = 0, views = 0;
};
TrainingData data_of(const TrainingOptions& options, const std::vector<ViewName>& fixed, std::int64_t step);
/// Training views that lie in folders; none where all are streamed.
std::vector<ViewName> fixed_names(const TrainingOptions& options);
/// "740 training views", or what stream_text says.
std::string data_text(const TrainingOptions& options, std::size_t fixed);

class TrainingTask {
 public:
  virtual ~TrainingTask() = default;

  virtual std::string net() const = 0;  // text that identifies the net's shape
  /// States that inference needs: what weights hold.
  virtual std::map<std::string, Shape> weights() const = 0;
  virtual const std::vector<ViewName>& views() const = 0;  // of training, those that lie in folders
  /// What a leg has drawn its views from when `step` steps are done.
  virtual TrainingData data(std::int64_t step) const = 0;
  virtual std::vector<std::string> notes() const = 0;  // first lines of the log
  virtual std::vector<LeftOut> left_out() const = 0;
  /// Weights of the maps under which a light learns; none where it learns under true ones.
  virtual std::optional<std::filesystem::path> maps_weights() const { return std::nullopt; }

  /// Reads what validation needs; batches begin at progress.step. Fills in progress.means where the task has them.
  virtual void begin(TrainingProgress& progress) = 0;
  /// One step on the next batch.
  virtual StepResult step(double rate) = 0;
  virtual std::vector<std::string> last_views() const = 0;  // of that batch
  /// There are no further steps: no thread reads or makes views any more.
  virtual void end() = 0;
  virtual Judgement judge() = 0;
  /// report.html, card and plots into the run; its weights are already there.
  virtual void report(const RunDirectory& run, const Config& config, const History& history,
                      const Provenance& provenance) = 0;
};

/// MGNet's maps; the light. Both make the states that `states.trained` lacks. `options` must outlive the task.
std::unique_ptr<TrainingTask> maps_task(Device device, const TrainingOptions& options, const TrainingStates& states);
std::unique_ptr<TrainingTask> light_task(Device device, const TrainingOptions& options, const TrainingStates& states);

}  // namespace clerestory
