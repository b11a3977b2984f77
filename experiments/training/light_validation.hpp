// Learned light judged along rays whose truth is known, beside what needs no network.
#pragma once
#include "experiments/evaluation/light_errors.hpp"
#include "experiments/training/light_batches.hpp"
#include "experiments/weights/history.hpp"
#include "host/graph/plan.hpp"
#include "nets/mixed_light.hpp"

namespace clerestory {

/// Who answers: both parts mixed, the out-of-view part alone, `light = image` (the photograph at hits, its mean
/// elsewhere), the best constant of the view under the very metric.
enum class LightAnswerer { Full, OutOfView, Photograph, Constant };
inline constexpr int light_answerers = 4;

/// Errors of each answerer over each class of rays: means over views that have such rays.
struct LightSummary {
  enum Rays { Hits, Misses, All, kinds };
  RadianceError errors[kinds][light_answerers];
  int views = 0;
  const RadianceError& of(Rays rays, LightAnswerer who) const { return errors[rays][static_cast<int>(who)]; }
  /// Errors in the order of error_names("light"); ratios to the better of photograph and constant.
  HistoryPoint point() const;
};

/// One validation view's rays, drawn once.
struct JudgedLight {
  std::string name;
  std::shared_ptr<const LightView> view;
  LightRays rays;
};

/// What the nets and the photograph say about rays, {3, count} planar. in_view means nothing on a miss.
struct LightAnswers {
  std::vector<float> full, in_view, out_of_view, photograph;
  std::vector<float> delta;  // of SSRT (host/ops/light/ssrt.hpp)
  std::vector<int> pixel;    // that a ray meets in the depth map, or -1
};

/// Runs the nets on rays of one view at a time, with the states given (running statistics, no jitter).
class LightPredictor {
 public:
  LightPredictor(Device device, const LightSizes& sizes, int width, int height, int rows, int samples,
                 std::shared_ptr<States> states);
  ~LightPredictor();
  LightAnswers answer(const LightView& view, const LightRays& rays);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Each view by itself.
std::vector<LightSummary> judge_each_light(const std::vector<JudgedLight>& views, LightPredictor& predictor);
LightSummary mean_of(const std::vector<LightSummary>& views);
inline LightSummary judge_light(const std::vector<JudgedLight>& views, LightPredictor& predictor) {
  return mean_of(judge_each_light(views, predictor));
}

}  // namespace clerestory
