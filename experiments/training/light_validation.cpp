#include "experiments/training/light_validation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/math/statistics.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

LightSizes without_jitter(LightSizes sizes) {
  sizes.out_of_view.march.jitter = false;
  return sizes;
}

}  // namespace

struct LightPredictor::State {
  Graph graph;
  LightAnswer answer;
  Value photograph;
  int samples;
  std::unique_ptr<Executor> run;
};

LightPredictor::LightPredictor(Device device, const LightSizes& given, int width, int height, int rows, int samples,
                               std::shared_ptr<States> states)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.samples = samples;
  const LightSizes sizes = without_jitter(given);
  const LitPicture picture = lit_pictures(s.graph, light_inputs(s.graph, 1, height, width), sizes, false)[0];
  const Shape three{1, 3, rows, samples};
  s.answer = ask_light(s.graph, picture, sizes, s.graph.input("points", three), s.graph.input("directions", three),
                       s.graph.input("skip", {1, 1, rows, samples}, Type::Int));
  s.photograph = photograph_radiance(picture.image, s.graph.input("ambient", {1, 3, 1, 1}), s.answer.hits);
  const std::vector<Value> outputs{s.answer.mixed, s.answer.in_view,    s.answer.out_of_view,
                                   s.photograph,   s.answer.hits.delta, s.answer.hits.pixel};
  s.run = std::make_unique<Executor>(compile(s.graph, outputs, device), std::move(states));
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
  return {run.fetch_floats(s.answer.mixed),       run.fetch_floats(s.answer.in_view),
          run.fetch_floats(s.answer.out_of_view), run.fetch_floats(s.photograph),
          run.fetch_floats(s.answer.hits.delta),  run.fetch(s.answer.hits.pixel).integer};
}

std::vector<LightSummary> judge_each_light(const std::vector<JudgedLight>& views, LightPredictor& predictor) {
  std::vector<LightSummary> summaries;
  for (const JudgedLight& v : views) {
    LightSummary& summary = summaries.emplace_back();
    summary.views = 1;
    const LightAnswers answers = predictor.answer(*v.view, v.rays);
    const KnownRays known(v.rays.light);
    KnownRays::Used used[LightSummary::kinds];
    for (std::size_t i = 0; i < v.rays.light.size(); ++i) {
      used[answers.pixel[i] >= 0 ? LightSummary::Hits : LightSummary::Misses].push_back(i);
      used[LightSummary::All].push_back(i);
    }
    for (int kind = 0; kind < LightSummary::kinds; ++kind) {
      if (used[kind].empty()) continue;
      const RadianceError each[light_answerers] = {
          known.error(answers.full, used[kind]), known.error(answers.out_of_view, used[kind]),
          known.error(answers.photograph, used[kind]), known.best_constant(used[kind])};
      for (int who = 0; who < light_answerers; ++who) summary.errors[kind][who].add(each[who]);
    }
  }
  return summaries;
}

LightSummary mean_of(const std::vector<LightSummary>& views) {
  LightSummary mean;
  for (const LightSummary& view : views) {
    ++mean.views;
    for (int kind = 0; kind < LightSummary::kinds; ++kind)
      for (int who = 0; who < light_answerers; ++who)
        if (view.errors[kind][who].views > 0) mean.errors[kind][who].add(view.errors[kind][who]);
  }
  for (auto& kind : mean.errors)
    for (RadianceError& e : kind) e.divide_by_views();
  return mean;
}

HistoryPoint LightSummary::point() const {
  HistoryPoint point;
  double logs = 0;
  int known = 0;
  const auto add = [&](double RadianceError::*error) {
    for (const Rays rays : {Hits, Misses, All}) {
      const bool any = of(rays, LightAnswerer::Full).views > 0;
      const double ours = of(rays, LightAnswerer::Full).*error;
      const double trivial =
          std::min(of(rays, LightAnswerer::Photograph).*error, of(rays, LightAnswerer::Constant).*error);
      point.errors.push_back(any ? ours : NAN), point.ratios.push_back(any ? ours / trivial : NAN);
      if (any && trivial > 0) logs += std::log(std::max(ours / trivial, 1e-6)), ++known;
    }
  };
  add(&RadianceError::relmse), add(&RadianceError::log_rmse);
  point.score = known > 0 ? std::exp(logs / known) : 1;
  return point;
}

}  // namespace clerestory
