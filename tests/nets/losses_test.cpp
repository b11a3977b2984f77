// VGG16's features and the perceptual distance against PyTorch, and how the terms add up.
#include "nets/losses.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nets/mgnet_training.hpp"
#include "nets/vgg.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

TEST(Losses, PerceptualDistanceIsPytorchs) {
  constexpr Shape kMap{2, 3, 20, 24}, kMask{2, 1, 20, 24};
  GoldenNet net("vgg16.safetensors", Precision::Double);
  const Value image = net.graph.input("image", kMap), truth = net.graph.input("truth", kMap),
              mask = net.graph.input("mask", kMask);
  const Scope scope{net.graph, false, "vgg"};
  const Value distance = perceptual_distance(scope, image, truth, mask);
  const std::map<std::string, Value> results{{"features", vgg_features(scope, image)},
                                             {"perceptual", distance},
                                             {"gradient.image", gradient(distance, std::vector<Value>{image}).front()}};
  net.fill_states();
  Tensor weights = formula("mask", kMask);
  for (double& m : weights.real) m = m > -0.2;
  net.run(results, {{"image", formula("image", kMap)}, {"truth", formula("truth", kMap)}, {"mask", weights}}, false);
  // Golden values are stored in float; double's own rounding is far below.
  for (const auto& [name, value] : results) net.expect_elements(name, name, 0x1p-22);
  EXPECT_TRUE(net.graph.parameters().empty()) << "VGG16 is frozen";
}

/// Loss terms of the compact net on a formula's batch, with these weights, by name.
std::map<std::string, double> terms(const LossWeights& weights) {
  GoldenNet net("vgg16.safetensors", Precision::Single);
  const MgnetTraining training =
      mgnet_training(net.graph, mgnet_size("compact"), {.batch = 1, .height = 32, .width = 32, .weights = weights});
  std::map<std::string, Tensor> feeds;
  const auto put = [&](const std::string& name, const Shape& s, double offset) {
    feeds[name] = formula(name, s);
    for (double& x : feeds[name].real) x += offset;
  };
  put("image", {1, 3, 32, 32}, 0.5), put("albedo", {1, 3, 32, 32}, 0.5), put("normal", {1, 3, 32, 32}, 0);
  put("material", {1, 2, 32, 32}, 0.5), put("depth", {1, 1, 32, 32}, 0.5), put("log_scale", {1, 1, 1, 1}, 1);
  for (const char* mask : {"albedo_mask", "geometry_mask", "material_mask"}) feeds[mask] = Tensor({1, 1, 32, 32}, 1);
  feeds["scale_mask"] = Tensor({1, 1, 1, 1}, 1), feeds["learning_rate"] = Tensor({}, 0), feeds["step"] = Tensor({}, 1);
  net.fill_states();
  std::map<std::string, Value> results(training.losses.begin(), training.losses.end());
  std::map<std::string, double> values;
  net.run(results, feeds, false);
  for (const auto& [name, value] : results) values[name] = net.result(name).real[0];
  return values;
}

TEST(Losses, LogDepthAgainstItsDefinitionAndGradient) {
  constexpr Shape kMap{2, 1, 3, 5};
  constexpr std::size_t pixels = 15;
  Tensor prediction = formula("prediction", kMap), truth = formula("truth", kMap), mask = formula("mask", kMap);
  for (std::size_t i = 0; i < 2 * pixels; ++i) {
    prediction.real[i] = 0.5 + 0.49 * prediction.real[i], truth.real[i] = 0.5 + 0.5 * truth.real[i];
    mask.real[i] = mask.real[i] > -0.3;
  }
  prediction.real[0] = 0, truth.real[1] = 0, truth.real[2] = 1;  // the ends of the range
  for (const bool empty : {false, true}) {
    if (empty) std::fill_n(mask.real.begin() + pixels, pixels, 0.0);  // the second picture has no depth
    const auto errors = [&](std::size_t i) {
      return std::log(prediction.real[i] + 0.01) - std::log(truth.real[i] + 0.01);
    };
    std::vector<double> left(2 * pixels);
    double loss = 0, count = 0;
    for (std::size_t picture = 0; picture < 2; ++picture) {
      double sum = 0, own = 0;
      for (std::size_t i = picture * pixels; i < (picture + 1) * pixels; ++i)
        sum += mask.real[i] * errors(i), own += mask.real[i];
      for (std::size_t i = picture * pixels; i < (picture + 1) * pixels; ++i) {
        left[i] = errors(i) - 0.85 * sum / std::max(own, 1.0);
        loss += mask.real[i] * left[i] * left[i];
      }
      count += own;
    }
    Graph graph;
    const Value p = graph.input("prediction", kMap), t = graph.input("truth", kMap), m = graph.input("mask", kMap);
    const Value value = log_depth_loss(p, t, m);
    const std::vector<Tensor> results =
        evaluate(graph, {value, gradient(value, std::vector<Value>{p}).front()}, Device::open(),
                 {{"prediction", prediction}, {"truth", truth}, {"mask", mask}}, {.precision = Precision::Double});
    // The means are taken over 1e-6 pixels more than there are: over a picture of errors up to ln 101, and over all.
    EXPECT_NEAR(results[0].real[0], loss / count, 1e-6 * loss / count);
    for (std::size_t i = 0; i < 2 * pixels; ++i)  // the mean is a constant to the gradient
      EXPECT_NEAR(results[1].real[i], 2 * mask.real[i] * left[i] / count / (prediction.real[i] + 0.01),
                  2e-6 * std::log(101.0) / count / (prediction.real[i] + 0.01))
          << i;
  }
}

TEST(Losses, MetallicEntropyAgainstItsDefinitionAndGradient) {
  constexpr Shape kMap{2, 1, 3, 5};
  constexpr std::size_t pixels = 30;
  Tensor prediction = formula("prediction", kMap), truth = formula("truth", kMap), mask = formula("mask", kMap);
  for (std::size_t i = 0; i < pixels; ++i) {
    prediction.real[i] = 0.5 + 0.5 * prediction.real[i], truth.real[i] = 0.5 + 0.5 * truth.real[i];
    mask.real[i] = mask.real[i] > -0.3;
  }
  for (std::size_t i = 0; i < 4; ++i)  // the ends of both ranges, right and wrong
    prediction.real[i] = i & 1, truth.real[i] = i >> 1, mask.real[i] = 1;
  for (const bool empty : {false, true}) {
    if (empty) mask = Tensor(kMap, 0);
    double loss = 0, count = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double m = truth.real[i], p = prediction.real[i];
      loss -= mask.real[i] * (m * std::log(p + 0.01) + (1 - m) * std::log(1.01 - p)), count += mask.real[i];
    }
    Graph graph;
    const Value p = graph.input("prediction", kMap), t = graph.input("truth", kMap), w = graph.input("mask", kMap);
    const Value value = metallic_entropy(p, t, w);
    const std::vector<Tensor> results =
        evaluate(graph, {value, gradient(value, std::vector<Value>{p}).front()}, Device::open(),
                 {{"prediction", prediction}, {"truth", truth}, {"mask", mask}}, {.precision = Precision::Double});
    if (empty) {
      EXPECT_EQ(results[0].real[0], 0);
      continue;
    }
    EXPECT_NEAR(results[0].real[0], loss / count, 1e-6 * loss / count);  // the mean is over 1e-6 pixels more
    for (std::size_t i = 0; i < pixels; ++i) {
      const double m = truth.real[i], q = prediction.real[i];
      const double slope = (-m / (q + 0.01) + (1 - m) / (1.01 - q)) * mask.real[i] / count;
      EXPECT_NEAR(results[1].real[i], slope, 1e-6 * std::abs(slope)) << i;
    }
  }
}

/// detail_loss() as its comment says it, of planes {n, c, h, w} in double.
double detail_of(Tensor error, Tensor weight) {
  const Shape first = error.shape;
  double total = 0;
  for (int level = 0; level < 4; ++level) {
    const Shape s = error.shape, half{s.n, s.c, s.h / 2, s.w / 2}, half_weight{s.n, 1, s.h / 2, s.w / 2};
    Tensor mean(half), mean_weight(half_weight);
    for (int n = 0; n < s.n; ++n)
      for (int c = 0; c < s.c; ++c)
        for (int y = 0; y < half.h; ++y)
          for (int x = 0; x < half.w; ++x) {
            double sum = 0, count = 0;
            for (int k = 0; k < 4; ++k) {
              const double w = weight.at(n, 0, 2 * y + k / 2, 2 * x + k % 2);
              sum += w * error.at(n, c, 2 * y + k / 2, 2 * x + k % 2), count += w;
            }
            mean.at(n, c, y, x) = count > 0 ? sum / count : 0, mean_weight.at(n, 0, y, x) = count / 4;
          }
    double bands = 0, weights = 0;
    for (int n = 0; n < s.n; ++n)
      for (int y = 0; y < s.h; ++y)
        for (int x = 0; x < s.w; ++x) {
          const double w = weight.at(n, 0, y, x), fy = 0.5 * (y + 0.5) - 0.5, fx = 0.5 * (x + 0.5) - 0.5;
          weights += w;
          for (int c = 0; c < s.c && w > 0; ++c) {
            double sum = 0, count = 0;
            for (int k = 0; k < 4; ++k) {
              const double from_y = std::floor(fy) + k / 2, from_x = std::floor(fx) + k % 2;
              const double share = (1 - std::abs(fy - from_y)) * (1 - std::abs(fx - from_x));
              const int cy = std::clamp(static_cast<int>(from_y), 0, half.h - 1),
                        cx = std::clamp(static_cast<int>(from_x), 0, half.w - 1);
              const double here = share * mean_weight.at(n, 0, cy, cx);
              sum += here * mean.at(n, c, cy, cx), count += here;
            }
            bands += w * std::abs(error.at(n, c, y, x) - sum / count);
          }
        }
    if (weights > 0) total += bands / weights;
    error = mean, weight = mean_weight;
  }
  return total / first.c;
}

TEST(Losses, DetailAgainstItsDefinitionAndDifferences) {
  constexpr Shape kMap{2, 2, 16, 32}, kMask{2, 1, 16, 32};
  Tensor error = formula("error", kMap), mask = formula("mask", kMask);
  for (std::size_t i = 0; i < mask.real.size(); ++i) mask.real[i] = mask.real[i] > -0.3;
  for (std::size_t i = 0; i < 16 * 9; ++i) mask.real[i / 9 * 32 + i % 9] = 0;  // more than a pixel of the widest scale
  Graph graph;
  const Value e = graph.input("error", kMap), m = graph.input("mask", kMask), value = detail_loss(e, m);
  const auto results_of = [&](const Tensor& errors, const Tensor& weights) {
    return evaluate(graph, {value, gradient(value, std::vector<Value>{e}).front()}, Device::open(),
                    {{"error", errors}, {"mask", weights}}, {.precision = Precision::Double});
  };
  const std::vector<Tensor> results = results_of(error, mask);
  const double expected = detail_of(error, mask);
  EXPECT_GT(expected, 0.1);
  // Every mean is over 1e-6 more than there is, of weights down to 1 / 256 of a pixel and a sixteenth of these.
  constexpr double rounding = 1e-6 * 256 * 16;
  EXPECT_NEAR(results[0].real[0], expected, rounding * expected);
  for (std::size_t i = 0; i < error.real.size(); i += 7) {
    const double kept = error.real[i], h = 1e-7;
    error.real[i] = kept + h;
    const double above = detail_of(error, mask);
    error.real[i] = kept - h;
    const double below = detail_of(error, mask);
    error.real[i] = kept;
    EXPECT_NEAR(results[1].real[i], (above - below) / (2 * h), rounding / 256 + 1e-15 * expected / h) << i;
  }
  const std::vector<Tensor> unknown = results_of(error, Tensor(kMask, 0));
  EXPECT_EQ(unknown[0].real[0], 0);
  EXPECT_EQ(*std::ranges::max_element(unknown[1].real), 0);
  EXPECT_EQ(*std::ranges::min_element(unknown[1].real), 0);
  // What a whole picture is wrong by is not of its detail.
  EXPECT_NEAR(results_of(Tensor(kMap, 3), mask)[0].real[0], 0, 3 * 4 * rounding);
}

// Which maps, which logarithm, which mask, which weight.
TEST(Losses, DetailIsOfLnDepthAndOfLnOneAndAlbedo) {
  std::map<std::string, Tensor> feeds;
  Graph graph;
  const auto map = [&](const std::string& name, int channels, bool mask = false) {
    Tensor& t = feeds[name] = formula(name, {1, channels, 16, 16});
    for (double& x : t.real) x = mask ? x > -0.3 : 0.5 + 0.49 * x;
    return graph.input(name, t.shape);
  };
  const Value number = graph.input("scale", {});
  const Maps maps{map("albedo", 3), map("material", 2), map("normal", 3), map("depth", 1), number};
  const MapTargets truth{map("true albedo", 3),
                         map("true normal", 3),
                         map("true material", 2),
                         map("true depth", 1),
                         number,
                         map("albedo mask", 1, true),
                         map("geometry mask", 1, true),
                         map("material mask", 1, true),
                         number};
  feeds["scale"] = Tensor({}, 0);
  LossWeights weights{.albedo = 0, .normal = 0, .material = 0, .depth = 0, .scale = 0};
  weights.depth_detail = 2, weights.albedo_detail = 3;
  const NamedValues terms = mgnet_losses({graph, true, ""}, maps, truth, weights);
  ASSERT_EQ(terms.size(), 3u);
  const std::vector<Tensor> results =
      evaluate(graph, {terms[1].second, terms[2].second}, Device::open(), feeds, {.precision = Precision::Double});
  const auto expected = [&](const std::string& name, double floor) {
    Tensor error = feeds.at(name);
    for (std::size_t i = 0; i < error.real.size(); ++i)
      error.real[i] = std::log(error.real[i] + floor) - std::log(feeds.at("true " + name).real[i] + floor);
    return detail_of(error, feeds.at(name == "depth" ? "geometry mask" : "albedo mask"));
  };
  EXPECT_EQ(terms[1].first, "depth_detail");
  EXPECT_EQ(terms[2].first, "albedo_detail");
  constexpr double rounding = 1e-6 * 256 * 16;  // as above
  EXPECT_NEAR(results[0].real[0], 2 * expected("depth", 0.01), rounding * results[0].real[0]);
  EXPECT_NEAR(results[1].real[0], 3 * expected("albedo", 1), rounding * results[1].real[0]);
}

// Every branch: pairs of either kind, right and wrong, a black pixel, places without a pair.
TEST(Losses, JudgementsAgainstTheirDefinitionAndDifferences) {
  constexpr Shape kMap{2, 3, 4, 5}, kPairs{1, 1, 2, 16};
  constexpr int plane = 20, count = 32;
  Tensor albedo = formula("albedo", kMap);
  for (double& v : albedo.real) v = 0.5 + 0.49 * v;
  for (int c = 0; c < 3; ++c) albedo.real[static_cast<std::size_t>(c * plane + 3)] = 0;
  std::vector<int> first(count, -1), second(count, -1);
  Tensor equal(kPairs, 0), ordered(kPairs, 0);
  for (std::size_t i = 0; i < 12; ++i) {  // the others stay empty
    first[i] = static_cast<int>(i * 7 % 40), second[i] = static_cast<int>((i * 11 + 3) % 40);
    (i % 3 == 0 ? equal : ordered).real[i] = 0.1 + 0.05 * static_cast<double>(i);
  }
  const auto lightness = [&](int pixel) {
    double sum = 0;
    for (int c = 0; c < 3; ++c)
      sum += albedo.real[static_cast<std::size_t>((pixel / plane * 3 + c) * plane + pixel % plane)];
    return std::log(sum / 3 + 0.001);
  };
  int wrong = 0, right = 0;
  const auto loss = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < 12; ++i) {
      const double apart = lightness(first[i]) - lightness(second[i]), over = std::max(apart + 0.5, 0.0);
      sum += 2 * (equal.real[i] * apart * apart + ordered.real[i] * over * over);
      if (ordered.real[i] > 0) ++(over > 0 ? wrong : right);
    }
    return sum;
  };
  Graph graph;
  const Value a = graph.input("albedo", kMap);
  const Value value =
      judgement_loss(a, {graph.input("first", kPairs, Type::Int), graph.input("second", kPairs, Type::Int),
                         graph.input("equal", kPairs), graph.input("ordered", kPairs)});
  const std::vector<Tensor> results =
      evaluate(graph, {value, gradient(value, std::vector<Value>{a}).front()}, Device::open(),
               {{"albedo", albedo},
                {"first", Tensor::of_int(kPairs, first)},
                {"second", Tensor::of_int(kPairs, second)},
                {"equal", equal},
                {"ordered", ordered}},
               {.precision = Precision::Double});
  const double expected = loss();
  EXPECT_GT(wrong, 2);
  EXPECT_GT(right, 0);
  EXPECT_NEAR(results[0].real[0], expected, 1e-13 * expected);
  for (std::size_t i = 0; i < albedo.real.size(); ++i) {
    const double kept = albedo.real[i], h = 1e-6 * (kept + 0.001);
    albedo.real[i] = kept + h;
    const double above = loss();
    albedo.real[i] = kept - h;
    const double below = loss();
    albedo.real[i] = kept;
    // Central differences err by h^2 times the third derivative and by rounding over h.
    EXPECT_NEAR(results[1].real[i], (above - below) / (2 * h),
                1e-8 * std::abs(results[1].real[i]) + 4e-16 * expected / h)
        << i;
  }
}

// The terms of Li et al. on maps that are given: one scale a picture, of albedo clamped after it, of depth in
// logarithms.
TEST(Losses, OfLiEtAlAgainstTheirDefinition) {
  constexpr int batch = 2, pixels = 15;
  std::map<std::string, Tensor> t;
  for (const auto& [name, channels] : {std::pair{"albedo", 3}, {"normal", 3}, {"material", 2}, {"depth", 1}})
    for (const std::string whose : {"their ", "true "}) {
      Tensor& map = t[whose + name] = formula(whose + name, {batch, channels, 3, 5});
      for (double& x : map.real) x = std::string(name) == "normal" ? 2 * x : 0.5 + x;
    }
  for (double& x : t["true albedo"].real) x = 0.5 + 0.5 * x;  // the scale brings some of theirs beyond 1
  for (const char* name : {"albedo_mask", "geometry_mask", "material_mask"}) {
    t[name] = formula(name, {batch, 1, 3, 5});
    for (double& x : t[name].real) x = x > -0.3;
  }
  const auto at = [&](const std::string& name, int n, int c, int i) { return t.at(name).at(n, c, i / 5, i % 5); };
  /// factor * the mean over the mask of e, which sums over channels.
  const auto mean = [&](const char* mask, double factor, const auto& e) {
    double sum = 0, count = 0;
    for (int n = 0; n < batch; ++n)
      for (int i = 0; i < pixels; ++i) sum += at(mask, n, 0, i) * e(n, i), count += at(mask, n, 0, i);
    return factor * sum / count;
  };
  const auto scale = [&](const std::string& map, const char* mask, int channels, int n) {
    double product = 0, square = 0;
    for (int i = 0; i < pixels; ++i)
      for (int c = 0; c < channels; ++c) {
        const double theirs = at("their " + map, n, c, i) * at(mask, n, 0, i);
        product += theirs * at("true " + map, n, c, i), square += theirs * theirs;
      }
    return product / square;
  };
  const auto square = [](double x) { return x * x; };
  int clamped = 0;
  std::map<std::string, double> wanted;
  wanted["albedo"] = mean("albedo_mask", 6.0 / 3, [&](int n, int i) {
    double e = 0;
    for (int c = 0; c < 3; ++c) {
      const double scaled = scale("albedo", "albedo_mask", 3, n) * at("their albedo", n, c, i);
      clamped += scaled > 1, e += square(std::min(scaled, 1.0) - at("true albedo", n, c, i));
    }
    return e;
  });
  wanted["normal"] = mean("geometry_mask", 4.0 / 3, [&](int n, int i) {
    double e = 0;
    for (int c = 0; c < 3; ++c) e += square(at("their normal", n, c, i) - at("true normal", n, c, i));
    return e;
  });
  wanted["material"] = mean("material_mask", 2, [&](int n, int i) {
    return square(2 * at("their material", n, 0, i) - 2 * at("true material", n, 0, i));
  });
  wanted["depth"] = mean("geometry_mask", 2, [&](int n, int i) {
    const double s = scale("depth", "geometry_mask", 1, n);
    return square(std::log1p(s * at("their depth", n, 0, i)) - std::log1p(at("true depth", n, 0, i)));
  });
  EXPECT_GT(clamped, 2);

  Graph graph;
  std::map<std::string, Value> v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const Value one = graph.fill({batch, 1, 1, 1}, 1);
  const Maps maps{v["their albedo"], v["their material"], v["their normal"], v["their depth"], one};
  const MapTargets truth{v["true albedo"],
                         v["true normal"],
                         v["true material"],
                         v["true depth"],
                         one,
                         v["albedo_mask"],
                         v["geometry_mask"],
                         v["material_mask"],
                         one};
  const NamedValues terms = mgnet_losses({graph, true, ""}, maps, truth, {.scale = 0, .terms = MapLosses::Li2020});
  std::vector<Value> outputs;
  for (const auto& [name, value] : terms) outputs.push_back(value);
  outputs.push_back(gradient(terms.front().second, std::vector<Value>{v["their albedo"]}).front());
  const std::vector<Tensor> results =
      evaluate(graph, outputs, device_for(Precision::Double), t, {.precision = Precision::Double});
  double sum = 0;
  for (std::size_t i = 1; i < terms.size(); ++i) {
    const double value = wanted.at(terms[i].first);
    EXPECT_NEAR(results[i].real[0], value, 1e-12 * value) << terms[i].first;  // sums of some 100 numbers
    sum += value;
  }
  EXPECT_EQ(terms.size(), 5u);
  const double pixels_known = std::accumulate(t["albedo_mask"].real.begin(), t["albedo_mask"].real.end(), 0.0);
  for (int n = 0; n < batch; ++n)
    for (int i = 0; i < pixels; ++i)
      for (int c = 0; c < 3; ++c) {  // the scale is a constant to the gradient
        const double s = scale("albedo", "albedo_mask", 3, n), scaled = s * at("their albedo", n, c, i);
        const double slope = scaled < 1 ? 4 * s * (scaled - at("true albedo", n, c, i)) : 0;
        EXPECT_NEAR(results[5].at(n, c, i / 5, i % 5), at("albedo_mask", n, 0, i) * slope / pixels_known, 1e-12);
      }
  EXPECT_NEAR(results[0].real[0], sum, 1e-12 * sum);
  EXPECT_THROW(map_losses_of("barron"), Error);
}

TEST(Losses, TermsAreWeightedAndAddUp) {
  const auto plain = terms({}), weighted = terms({.albedo = 2, .normal = 0.5, .material = 0, .depth = 1, .scale = 3});
  double sum = 0;
  for (const auto& [name, value] : plain)
    if (name != "loss") sum += value;
  // Each term carries a few roundings of its own size.
  EXPECT_NEAR(plain.at("loss"), sum, 8 * 0x1p-23 * sum);
  EXPECT_EQ(weighted.count("material"), 0u);
  EXPECT_NEAR(weighted.at("albedo"), 2 * plain.at("albedo"), 4 * 0x1p-23 * plain.at("albedo"));
  EXPECT_NEAR(weighted.at("scale"), 3 * plain.at("scale"), 4 * 0x1p-23 * plain.at("scale"));
  EXPECT_THROW(terms({.albedo = 0, .normal = 0, .material = 0, .depth = 0, .scale = 0}), Error);
  const auto perceptual = terms({.perceptual = 0.02});
  EXPECT_GT(perceptual.at("albedo"), plain.at("albedo"));
  EXPECT_GT(perceptual.at("normal"), plain.at("normal"));
  EXPECT_GT(perceptual.at("material"), plain.at("material"));
  EXPECT_EQ(perceptual.at("depth"), plain.at("depth"));
  const std::vector<std::string> more{"log_depth", "metallic", "depth_detail", "albedo_detail"};
  const auto beyond = terms({.log_depth = 2, .metallic = 0.5, .depth_detail = 0.2, .albedo_detail = 0.1});
  double with_them = plain.at("loss");
  for (const std::string& term : more) {
    EXPECT_EQ(plain.count(term), 0u);
    EXPECT_GT(beyond.at(term), 0);
    with_them += beyond.at(term);
  }
  EXPECT_NEAR(beyond.at("loss"), with_them, 8 * 0x1p-23 * beyond.at("loss"));
}

// ---- What the perceptual distance looks through ----

constexpr Shape kStepMap{1, 3, 32, 32}, kStepMask{1, 1, 32, 32};

PerceptualFeatures random_vgg() { return {PerceptualFeatures::From::Random}; }
/// An encoder as learned ones are built; its weights are random here.
PerceptualFeatures encoder_of(const std::string& preset) {
  return {PerceptualFeatures::From::Rooms, mgnet_size(preset)};
}

/// The perceptual distance of pairs of maps in double, with the weights of a seed.
struct PerceptualTrial {
  explicit PerceptualTrial(const PerceptualFeatures& through, std::uint64_t seed = 1)
      : device(device_for(Precision::Double)), states(std::make_shared<States>(device, Precision::Double)) {
    const Scope scope{graph, true, through.scope()};
    prediction = graph.input("prediction", kStepMap);
    distance =
        perceptual_distance(scope, prediction, graph.input("truth", kStepMap), graph.input("mask", kStepMask), through);
    slope = gradient(distance, std::vector<Value>{prediction}).front();
    states->initialise(graph, seed);
  }

  std::vector<Tensor> run(const Tensor& p, const Tensor& t, const Tensor& m, bool with_slope = false) {
    return evaluate(graph, with_slope ? std::vector{distance, slope} : std::vector{distance}, device,
                    {{"prediction", p}, {"truth", t}, {"mask", m}}, {.precision = Precision::Double}, 0, states);
  }
  double of(const Tensor& p, const Tensor& t, const Tensor& m = Tensor(kStepMask, 1)) {
    return run(p, t, m)[0].real[0];
  }

  Graph graph;
  Device device;
  std::shared_ptr<States> states;
  Value prediction, distance, slope;
};

/// A step from 0.2 to 0.8 in the middle, a ramp over `blur` columns in its place.
Tensor step_map(double blur) {
  Tensor map(kStepMap, 0);
  for (std::size_t i = 0; i < map.real.size(); ++i) {
    const double beyond = static_cast<double>(i % 32) - 15.5;
    map.real[i] = 0.5 + 0.6 * std::clamp(blur > 0 ? beyond / blur : beyond, -0.5, 0.5);
  }
  return map;
}

TEST(PerceptualFeatures, DistanceIsNothingOfEqualMapsAndGrowsWithTheBlurOfEdges) {
  for (const PerceptualFeatures& through : {random_vgg(), encoder_of("lite"), encoder_of("compact")}) {
    PerceptualTrial trial(through);
    EXPECT_TRUE(trial.graph.parameters().empty()) << "features are frozen";
    double before = trial.of(step_map(0), step_map(0));
    EXPECT_EQ(before, 0);
    for (const double blur : {2.0, 4.0, 8.0, 16.0}) {
      const double distance = trial.of(step_map(blur), step_map(0));
      EXPECT_GT(distance, before) << through.scope() << ", a ramp over " << blur << " columns";
      before = distance;
    }
    EXPECT_LT(before, 1) << "a part of the true map's features";
    EXPECT_EQ(trial.of(step_map(8), step_map(0), Tensor(kStepMask, 0)), 0) << "nothing is known";
  }
}

// The mean square of the features divides: a net whose last features are all twice as large gives the same distance.
TEST(PerceptualFeatures, DistanceDoesNotKnowHowLargeFeaturesAre) {
  PerceptualTrial trial(random_vgg());
  const double before = trial.of(step_map(4), step_map(0));
  Tensor last = trial.states->get("vgg.features.14.weight");
  for (double& w : last.real) w *= 2;
  trial.states->set("vgg.features.14.weight", last);
  // 1e-6 beside a mean square of features, which He's weights keep near that of the map.
  EXPECT_NEAR(trial.of(step_map(4), step_map(0)), before, 1e-5 * before);
}

TEST(PerceptualFeatures, RandomOnesAreThoseOfTheirSeed) {
  const auto distance = [](std::uint64_t seed) {
    return PerceptualTrial(random_vgg(), seed).of(step_map(4), step_map(0));
  };
  EXPECT_EQ(distance(1), distance(1));
  EXPECT_NE(distance(1), distance(2));
}

TEST(PerceptualFeatures, GradientIsThatOfDifferences) {
  Tensor prediction = formula("prediction", kStepMap), truth = formula("truth", kStepMap), mask(kStepMask, 1);
  for (double& x : prediction.real) x = 0.5 + 0.9 * x;
  for (double& x : truth.real) x = 0.5 + 0.9 * x;
  for (std::size_t i = 0; i < 32 * 8; ++i) mask.real[i] = 0;
  // Central: of order step^2, roundings 1e-16 / step. Of some 1e5 units step * 1e5 bend between both ends, each a
  // 1e5th of the slope.
  constexpr double step = 1e-6, allowed = 1e-5;
  for (const PerceptualFeatures& through : {random_vgg(), encoder_of("lite"), encoder_of("compact")}) {
    PerceptualTrial trial(through);
    const std::vector<double> slope = trial.run(prediction, truth, mask, true)[1].real;
    for (int i = 0; i < 32 * 8; ++i) ASSERT_EQ(slope[static_cast<std::size_t>(i)], 0) << "under the mask";
    for (const std::string name : {"one way", "another"}) {
      const Tensor way = formula(name, kStepMap);
      Tensor above = prediction, below = prediction;
      double along = 0, size = 0;
      for (std::size_t i = 0; i < way.real.size(); ++i) {
        above.real[i] += step * way.real[i], below.real[i] -= step * way.real[i];
        along += slope[i] * way.real[i], size += std::abs(slope[i] * way.real[i]);
      }
      const double difference = (trial.of(above, truth, mask) - trial.of(below, truth, mask)) / (2 * step);
      EXPECT_NEAR(along, difference, allowed * size) << through.scope() << ", " << name;
      EXPECT_GT(size, 0);
    }
  }
}

TEST(PerceptualFeatures, AreNotTrainedWithTheNet) {
  for (const PerceptualFeatures& through : {random_vgg(), encoder_of("lite")}) {
    Graph graph;
    MgnetTrainingOptions options{.batch = 1, .height = 32, .width = 32};
    options.weights.perceptual = 0.02, options.weights.features = through;
    const MgnetTraining training = mgnet_training(graph, mgnet_size("compact"), options);
    int seen = 0;
    for (const Value& v : graph.states())
      seen += static_cast<const StateOp&>(*v.node->op).state_name.starts_with(std::string(through.scope()) + ".");
    EXPECT_GT(seen, 10);
    for (const Value& p : training.parameters) {
      const std::string& name = static_cast<const StateOp&>(*p.node->op).state_name;
      EXPECT_FALSE(name.starts_with(std::string(through.scope()) + ".")) << name;
    }
  }
}

}  // namespace
}  // namespace clerestory
