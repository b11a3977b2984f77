// Photographs of IIW and NYUv2 as views of a training, and a training with them.
#include "experiments/training/finetune_views.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <set>

#include "experiments/evaluation/benchmark_errors.hpp"
#include "experiments/weights/weights.hpp"
#include "host/io/files.hpp"
#include "host/io/safetensors.hpp"
#include "host/math/statistics.hpp"
#include "host/report/metrics.hpp"
#include "tests/experiments/training_run.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr Size kSize{32, 32};

/// Values that say where a pixel is, as fractions of width and height, and a third that makes no picture black.
Image places(int width, int height) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      image.at(0, y, x) = (static_cast<float>(x) + 0.5f) / static_cast<float>(width);
      image.at(1, y, x) = (static_cast<float>(y) + 0.5f) / static_cast<float>(height);
      image.at(2, y, x) = 0.5f;
    }
  return image;
}

JudgedPair pair(std::size_t first, std::size_t second, std::optional<Darker> darker, double weight = 1) {
  return {first, second, darker, weight};
}

/// Nine points, a grid, and one of glass.
Judgements judged_grid() {
  Judgements j;
  for (int i = 0; i < 9; ++i) j.points.push_back({i + 1, 0.35 + 0.15 * (i % 3), 0.3 + 0.2 * (i / 3), true});
  j.points.push_back({10, 0.5, 0.5, false});
  j.comparisons = {pair(0, 1, Darker::First, 0.5), pair(1, 2, Darker::Second, 0.25), pair(3, 4, Darker::Equal, 2),
                   pair(4, 5, std::nullopt),       pair(5, 6, Darker::First, 0),     pair(6, 9, Darker::Equal),
                   pair(7, 8, Darker::Equal, 1)};
  return j;
}

TEST(FinetuneViews, JudgementsStandAtThePixelsThatPeopleSaw) {
  const Image picture = places(64, 48);
  const Judgements said = judged_grid();
  const double exposure = exposure_of(picture.data);
  std::set<float> cuts;
  for (std::uint64_t key = 0; key < 8; ++key) {
    const PreparedView view = iiw_view(picture, said, kSize, key);
    ASSERT_EQ(view.image.width, 32);
    ASSERT_EQ(view.image.height, 32);
    cuts.insert(view.image.data[0]);
    ASSERT_EQ(view.judged.size(), 4u) << "those without a verdict, weight or opaque points do not count";
    const std::vector<std::pair<std::size_t, std::size_t>> darker_first{{3, 4}, {7, 8}, {0, 1}, {2, 1}};
    const std::vector<float> weights{2.0f / 2, 1.0f / 2, 0.5f / 2, 0.25f / 2};
    for (std::size_t i = 0; i < 4; ++i) {
      const JudgedPixels& j = view.judged[i];
      EXPECT_EQ(j.equal, i < 2);
      EXPECT_EQ(j.weight, weights[i]);
      for (const auto& [pixel, point] : {std::pair{j.darker, said.points[darker_first[i].first]},
                                         std::pair{j.other, said.points[darker_first[i].second]}}) {
        // at most half a pixel of 43 x 32 away, whose mean is its centre's but for half a pixel of 64 x 48
        EXPECT_NEAR(view.image.at(0, pixel / 32, pixel % 32) / exposure, point.x, 0.5 / 43 + 0.5 / 64) << key;
        EXPECT_NEAR(view.image.at(1, pixel / 32, pixel % 32) / exposure, point.y, 0.5 / 32 + 0.5 / 48) << key;
      }
    }
    for (const Image* mask : {&view.masks.albedo, &view.masks.geometry, &view.masks.material})
      EXPECT_EQ(sum(mask->data), 0) << "no map is known";
    EXPECT_EQ(view.scene_scale, 0);
  }
  EXPECT_GT(cuts.size(), 3u) << "the cut is drawn";
  EXPECT_EQ(iiw_view(picture, said, kSize, 3).image.data, iiw_view(picture, said, kSize, 3).image.data);
}

TEST(FinetuneViews, PointsBesideTheCutAndJudgementsBeyondTheMostAreLeftOut) {
  Judgements said;
  said.points = {{1, 0.0, 0.5, true}, {2, 1.0, 0.5, true}, {3, 0.45, 0.5, true}, {4, 0.55, 0.5, true}};
  said.comparisons = {pair(0, 1, Darker::Equal)};
  for (std::uint64_t key = 0; key < 8; ++key)
    EXPECT_TRUE(iiw_view(places(128, 32), said, kSize, key).judged.empty()) << "the cut is a quarter as wide";
  said.comparisons.assign(kMostJudgements + 100, pair(2, 3, Darker::First));
  const PreparedView whole = iiw_view(places(32, 32), said, kSize, 1);
  ASSERT_EQ(whole.judged.size(), kMostJudgements);
  double weight = 0;
  for (const JudgedPixels& j : whole.judged) weight += j.weight;
  EXPECT_NEAR(weight, 1, kMostJudgements * kFloatRounding);
}

/// A stream of one view, over and over.
struct OneView : TrainingViews {
  PreparedView view;
  MakeView at(std::uint64_t) override {
    return [this] { return NamedView{"one", view, true}; };
  }
  std::vector<ViewName> some(std::uint64_t, std::size_t) override { return {}; }
};

TEST(FinetuneViews, ABatchCountsPixelsOverItsPaddedPicturesMirroredOrNot) {
  OneView views;
  views.view = iiw_view(places(40, 24), judged_grid(), {40, 24}, 5);
  constexpr int n = 6;
  const TrainingBatch batch = begin_batch(views, {}, 1, 0, 0, n).get();
  ASSERT_EQ(batch.w, 64);
  ASSERT_EQ(batch.h, 32);
  ASSERT_EQ(batch.judged.size(), n * views.view.judged.size());
  std::set<bool> mirrored_seen;
  const std::size_t plane = 64 * 32;
  for (std::size_t i = 0; i < batch.judged.size(); ++i) {
    const JudgedPixels &got = batch.judged[i], &own = views.view.judged[i % views.view.judged.size()];
    const std::size_t picture = i / views.view.judged.size(), at = static_cast<std::size_t>(got.darker);
    ASSERT_EQ(at / plane, picture);
    const float *red = &batch.image[picture * 3 * plane], *green = red + plane;
    const std::size_t from = static_cast<std::size_t>(own.darker);
    const float gain = green[at % plane] / views.view.image.plane(1)[from];
    EXPECT_NEAR(red[at % plane], gain * views.view.image.plane(0)[from], 4 * kFloatRounding) << i;
    mirrored_seen.insert(at % 64 != from % 40);
  }
  EXPECT_EQ(mirrored_seen.size(), 2u);
}

TEST(FinetuneViews, MeasuredDepthAndNormalsAreKnownWhereBothCount) {
  constexpr int width = 64, height = 48;
  const Image picture = places(width, height);
  Image depth(width, height, 1, 3.0f);
  NyuNormals normals{Image(width, height, 3), Image(width, height, 1, 1.0f)};
  std::fill_n(normals.normal.plane(2), width * height, 1.0f);
  for (int x = 0; x < width; ++x)
    for (int y = 0; y < 12; ++y) {
      depth.at(0, y, x) = y < 4 ? static_cast<float>(kFarthestJudged) : y < 8 ? static_cast<float>(kNearestJudged) : 3;
      normals.mask.at(0, y, x) = y < 8;
    }
  std::set<float> gains;
  for (std::uint64_t key = 0; key < 8; ++key) {
    const PreparedView view = nyu_view(picture, depth, normals, {32, 24}, key);
    EXPECT_EQ(sum(view.masks.albedo.data), 0);
    EXPECT_EQ(sum(view.masks.material.data), 0);
    EXPECT_TRUE(view.judged.empty());
    EXPECT_NEAR(view.scene_scale, 3, 3 * kFloatRounding) << "metres";
    const float blue = view.image.at(2, 0, 0);
    gains.insert(view.image.at(1, 0, 0) / blue);
    // The cut's share of the width, times red's gain over blue's.
    const double span = 0.5 * (view.image.at(0, 12, 31) - view.image.at(0, 12, 0)) / blue * 32 / 31;
    EXPECT_GT(span, 0.875 * 0.8 / 1.2 - 0.02);
    EXPECT_LT(span, 0.9375 * 1.2 / 0.8 + 0.02);
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 32; ++x) {
        const bool known = view.masks.geometry.at(0, y, x) > 0;
        if (y == 0 || y == 23) {
          EXPECT_EQ(known, y == 23) << "the cut begins at most 6 rows below the top";
        }
        if (!known) continue;
        EXPECT_NEAR(view.truth.depth.at(0, y, x) * view.scene_scale, 3, 6 * kFloatRounding);
        EXPECT_EQ(view.truth.normal.at(2, y, x), 1);
      }
  }
  EXPECT_GT(gains.size(), 4u);
}

struct Finetuning : TrainingRun {
  fs::path iiw = folder / "iiw", nyu = folder / "nyu";

  /// Photographs whose left half is said to be darker; the split's first and every fifth is for tests.
  void write_iiw(int count) const {
    fs::create_directories(iiw);
    for (int i = 0; i < count; ++i) {
      write_png(iiw / fmt::format("{}.png", i), places(48, 32));
      Judgements said;
      for (int p = 0; p < 4; ++p) said.points.push_back({p + 1, 0.3 + 0.3 * (p % 2), 0.3 + 0.3 * (p / 2), true});
      said.comparisons = {pair(0, 1, Darker::First), pair(3, 2, Darker::Second), pair(0, 2, Darker::Equal)};
      write_judgements(iiw / fmt::format("{}.json", i), said);
    }
  }
  void write_nyu(int count) const {
    fs::create_directories(nyu);
    NyuWriter writer(nyu / kNyuFile, count, 48, 36);
    NyuNormals normals{Image(48, 36, 3), Image(48, 36, 1, 1.0f)};
    std::fill_n(normals.normal.plane(2), 48 * 36, 1.0f);
    for (int n = 1; n <= count; ++n) {
      writer.put(n, places(48, 36), Image(48, 36, 1, 2.5f));
      write_nyu_normals(nyu, n, normals);
    }
    writer.commit();
  }
  std::vector<double> recorded(const fs::path& run, const std::string& metric) const {
    return curve_of(read_metrics(run / "metrics.jsonl"), metric).values;
  }
};

TEST_F(Finetuning, PhotographsStandAmongTheViewsAndAllOfThemComeUp) {
  write_iiw(6), write_nyu(3);
  write_file(folder / "numbers.txt", "2\n0003\n");
  FinetuneOptions options{iiw, nyu, folder / "numbers.txt", 0.5};
  const auto set = std::make_shared<FinetuneSet>(options);
  std::vector<std::string> names;
  for (const ViewName& name : set->names()) names.push_back(name.room.filename().string() + "/" + name.id);
  EXPECT_EQ(names, (std::vector<std::string>{"iiw/1", "iiw/2", "iiw/3", "iiw/4", "nyu/0002", "nyu/0003"}))
      << "IIW's pictures 0 and 5 are for tests";
  EXPECT_EQ(set->text(), "photographs in 50 % of the views: 4 of IIW, 2 of NYUv2");
  const auto views = finetune_views(std::make_unique<OneView>(), set, kSize, 9);
  std::map<std::string, int> seen;
  for (std::uint64_t position = 0; position < 400; ++position) ++seen[fs::path(views->at(position)().name).filename()];
  EXPECT_EQ(seen.size(), 7u);
  EXPECT_NEAR(seen["one"], 200, 40) << "four standard deviations of a coin";
  EXPECT_NEAR(seen["0002"] + seen["0003"], 100, 35);
  for (const char* name : {"1.png", "2.png", "3.png", "4.png"}) EXPECT_NEAR(seen[name], 25, 20) << name;
}

TEST_F(Finetuning, ATrainingLearnsWhatPeopleSayAndDoesTheSameAgain) {
  write_iiw(6), write_nyu(3);
  const std::vector<std::string> words{"finetune.iiw=" + iiw.string(), "finetune.nyu=" + nyu.string(),
                                       "finetune.share=0.75", "train.rate=3e-3", "log.every=1"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = words;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const TrainingOutcome learned = run("learned", with({"train.steps=40"}));
  const std::vector<double> losses = recorded(run_below("learned"), "train/judgements");
  ASSERT_EQ(losses.size(), 40u);
  const auto mean_of = [&](std::size_t begin) {
    return std::accumulate(losses.begin() + static_cast<long>(begin), losses.begin() + static_cast<long>(begin + 15),
                           0.0) /
           15;
  };
  EXPECT_LT(mean_of(25), 0.7 * mean_of(0));

  const History history = read_history(learned.weights);
  EXPECT_TRUE(saw_photographs(history));
  EXPECT_THAT(history.legs.back().overrides, testing::Contains("finetune.iiw=\"" + iiw.filename().string() + "\""))
      << "no path of this machine";
  EXPECT_THAT(model_card(history, {}, {}), HasSubstr("on photographs, by the legs below"));

  const TrainingOutcome again = run("again", with({"train.steps=40"}));
  const auto one = read_safetensors(learned.weights), other = read_safetensors(again.weights);
  for (const auto& [name, stored] : one.tensors)
    EXPECT_TRUE(stored.floats("learned") == other.tensors.at(name).floats("again")) << name;
}

TEST_F(Finetuning, WithoutPhotographsThereIsNoSuchTerm) {
  run("rooms", {"train.steps=1", "log.every=1"});
  EXPECT_TRUE(recorded(run_below("rooms"), "train/judgements").empty());
  EXPECT_FALSE(recorded(run_below("rooms"), "train/albedo").empty());
}

TEST_F(Finetuning, WhatCannotBeLearnedFromIsRefusedByName) {
  const auto refused = [&](std::vector<std::string> words) {
    words.push_back("train.steps=1");
    return message_of([&] { run("refused", words); }, ErrorKind::Usage);
  };
  fs::create_directories(iiw);
  EXPECT_THAT(refused({"finetune.iiw=" + iiw.string()}), HasSubstr(iiw.string()));
  write_iiw(1);
  EXPECT_THAT(refused({"finetune.iiw=" + iiw.string()}), HasSubstr("training split"));
  EXPECT_THAT(refused({"finetune.nyu=" + nyu.string()}), HasSubstr("normals"));
  write_nyu(1);
  EXPECT_THAT(refused({"finetune.nyu=" + nyu.string(), "finetune.share=0"}), HasSubstr("finetune.share"));
  EXPECT_THAT(refused({"finetune.nyu_list=" + (folder / "n.txt").string()}), HasSubstr("finetune.nyu_list"));
  write_file(folder / "n.txt", "7\n");
  EXPECT_THAT(refused({"finetune.nyu=" + nyu.string(), "finetune.nyu_list=" + (folder / "n.txt").string()}),
              HasSubstr("n.txt"));
  EXPECT_THAT(refused({"model.kind=light", "finetune.iiw=" + iiw.string()}), HasSubstr("finetune.iiw"));
}

}  // namespace
}  // namespace clerestory
