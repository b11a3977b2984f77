#include "experiments/training/light_validation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/math/statistics.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr double kFloor = 0.01;

LightSizes without_jitter(LightSizes sizes) {
  sizes.out_of_view.march.jitter = false;
  return sizes;
}

struct Sums {
  double relative = 0, logarithmic = 0;
  void add(double y, double truth) {
    const double d = y - truth, l = std::log((std::max(y, 0.0) + kFloor) / (truth + kFloor));
    relative += d * d / (truth * truth + kFloor), logarithmic += l * l;
  }
};

/// Errors of a view over the rays that `used` holds.
class ViewErrors {
 public:
  ViewErrors(const LightRays& rays, const std::vector<std::size_t>& used) : rays_(rays), used_(used) {}

  LightError of(const std::vector<float>& planar) const {
    return error([&](std::size_t c, std::size_t i) { return static_cast<double>(planar[c * rays_.light.size() + i]); },
                 [&](std::size_t c, std::size_t i) { return static_cast<double>(planar[c * rays_.light.size() + i]); });
  }

  /// Of the constants, one a channel, that make each error least.
  LightError of_best_constant() const {
    std::array<double, 3> weighted{}, weights{}, logs{};
    for (const std::size_t i : used_)
      for (std::size_t c = 0; c < 3; ++c) {
        const double t = truth(c, i), w = 1 / (t * t + kFloor);
        weighted[c] += w * t, weights[c] += w, logs[c] += std::log(t + kFloor);
      }
    const double count = static_cast<double>(used_.size());
    return error([&](std::size_t c, std::size_t) { return weighted[c] / weights[c]; },
                 [&](std::size_t c, std::size_t) { return std::exp(logs[c] / count) - kFloor; });
  }

 private:
  double truth(std::size_t c, std::size_t i) const { return static_cast<double>(rays_.light[i][c]); }

  template <class Relative, class Logarithmic>
  LightError error(const Relative& relative, const Logarithmic& logarithmic) const {
    Sums r, l;
    for (const std::size_t i : used_)
      for (std::size_t c = 0; c < 3; ++c) r.add(relative(c, i), truth(c, i)), l.add(logarithmic(c, i), truth(c, i));
    const double values = 3 * static_cast<double>(used_.size());
    return {r.relative / values, std::sqrt(l.logarithmic / values), 1};
  }

  const LightRays& rays_;
  const std::vector<std::size_t>& used_;
};

}  // namespace

struct LightPredictor::State {
  Graph graph;
  LightAnswer answer;
  Value photograph, hit;
  int samples;
  std::unique_ptr<Executor> run;
};

LightPredictor::LightPredictor(Device device, const LightSizes& given, int width, int height, int rows, int samples,
                               std::shared_ptr<States> states, const std::string& gemm)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.samples = samples;
  const LightSizes sizes = without_jitter(given);
  const LitPicture picture = lit_pictures(s.graph, lit_inputs(s.graph, 1, height, width), sizes, false)[0];
  const Shape three{1, 3, rows, samples};
  s.answer = ask_light(s.graph, picture, sizes, s.graph.input("points", three), s.graph.input("directions", three),
                       s.graph.input("skip", {1, 1, rows, samples}, Type::Int));
  s.photograph = photograph_radiance(picture.image, s.graph.input("ambient", {1, 3, 1, 1}), s.answer.hits);
  s.hit = gather_rays(s.graph.fill({1, 1, height, width}, 1), s.answer.hits.pixel);
  s.run = std::make_unique<Executor>(
      compile(s.graph, {s.answer.mixed, s.answer.out_of_view, s.photograph, s.hit}, device, {.gemm = gemm}),
      std::move(states));
}

LightPredictor::~LightPredictor() = default;

LightAnswers LightPredictor::answer(const LightView& view, const LightRays& rays) {
  State& s = *state_;
  Executor& run = *s.run;
  const Tensor depth = tensor_of(view.depth);
  const std::array<double, 3> ambient = ambient_of(view.image, view.emission.data.data());
  run.feed("image", tensor_of(view.image)), run.feed("albedo", tensor_of(view.albedo));
  run.feed("normal", tensor_of(view.normal)), run.feed("material", tensor_of(view.material));
  run.feed("depth", depth), run.feed("range", depth_range(depth)),
      run.feed("ambient", Tensor({1, 3, 1, 1}, std::vector<double>(ambient.begin(), ambient.end())));
  run.feed("camera", camera_tensor(std::span(&view.camera, 1)));
  for (const auto& [name, tensor] : ray_tensors(rays, s.samples)) run.feed(name, tensor);
  run.run();
  return {run.fetch_floats(s.answer.mixed), run.fetch_floats(s.answer.out_of_view), run.fetch_floats(s.photograph),
          run.fetch_floats(s.hit)};
}

LightSummary judge_light(const std::vector<JudgedLight>& views, LightPredictor& predictor) {
  LightSummary summary;
  summary.views = static_cast<int>(views.size());
  for (const JudgedLight& v : views) {
    const LightAnswers answers = predictor.answer(*v.view, v.rays);
    std::vector<std::size_t> used[LightSummary::kinds];
    for (std::size_t i = 0; i < v.rays.light.size(); ++i) {
      used[answers.hit[i] > 0 ? LightSummary::Hits : LightSummary::Misses].push_back(i);
      used[LightSummary::All].push_back(i);
    }
    for (int kind = 0; kind < LightSummary::kinds; ++kind) {
      if (used[kind].empty()) continue;
      const ViewErrors errors(v.rays, used[kind]);
      const LightError each[light_answerers] = {errors.of(answers.full), errors.of(answers.out_of_view),
                                                errors.of(answers.photograph), errors.of_best_constant()};
      for (int who = 0; who < light_answerers; ++who) {
        LightError& sum = summary.errors[kind][who];
        sum.relmse += each[who].relmse, sum.log_rmse += each[who].log_rmse, ++sum.views;
      }
    }
  }
  for (auto& kind : summary.errors)
    for (LightError& e : kind)
      if (e.views > 0) e.relmse /= e.views, e.log_rmse /= e.views;
  return summary;
}

HistoryPoint LightSummary::point() const {
  HistoryPoint point;
  double logs = 0;
  int known = 0;
  const auto add = [&](double LightError::*error) {
    for (const Rays rays : {Hits, Misses, All}) {
      const bool any = of(rays, LightAnswerer::Full).views > 0;
      const double ours = of(rays, LightAnswerer::Full).*error;
      const double trivial =
          std::min(of(rays, LightAnswerer::Photograph).*error, of(rays, LightAnswerer::Constant).*error);
      point.errors.push_back(any ? ours : NAN), point.ratios.push_back(any ? ours / trivial : NAN);
      if (any && trivial > 0) logs += std::log(std::max(ours / trivial, 1e-6)), ++known;
    }
  };
  add(&LightError::relmse), add(&LightError::log_rmse);
  point.score = known > 0 ? std::exp(logs / known) : 1;
  return point;
}

std::map<std::string, Shape> light_states(const LightSizes& sizes) {
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, lit_inputs(graph, 1, 64, 64), sizes, false)[0];
  ask_light(graph, picture, sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  std::map<std::string, Shape> states;
  for (const Value& v : graph.states()) states[static_cast<const StateOp&>(*v.node->op).state_name] = v.shape();
  return states;
}

}  // namespace clerestory
