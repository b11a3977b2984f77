// Studies of the light: their measures on cases done by hand, and the studies whole, at a size where nothing can be
// said of the nets, which are untrained.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "experiments/evaluation/detection.hpp"
#include "experiments/evaluation/light_errors.hpp"
#include "experiments/studies/findings.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/uncertainty_study.hpp"
#include "experiments/truth/lit_room.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/roundings.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr double kRounding = 1e-12;  // of a few sums of doubles near 1

// --- Measures
// ---------------------------------------------------------------------------------------------------------

TEST(LightErrors, ByHand) {
  // Two rays; the second weighs three times as much. Only the first channel is off, by 1 and by -0.5.
  const std::vector<std::array<float, 3>> truth{{1, 1, 1}, {0, 1, 1}};
  const std::vector<float> answer{2, -0.5f, 1, 1, 1, 1};
  const KnownRays rays(truth, {1, 3}), alike(truth);
  const RadianceError e = rays.error(answer, {0, 1});
  const double first = 1 / 1.01, second = 0.25 / 0.01, l = std::log(2.01 / 1.01);  // a negative answer counts as 0
  EXPECT_NEAR(e.relmse, (first + 3 * second) / 12, kRounding);
  EXPECT_NEAR(e.log_rmse, std::sqrt(l * l / 12), kRounding);
  EXPECT_NEAR(e.smape, (1 / 3.01 + 3 * (0.5 / 0.51)) / 12, kRounding);
  EXPECT_NEAR(e.psnr, -10 * std::log10(3 * 0.25 / 12), 10 * kRounding)
      << "values above 1 are white, below 0 they are not clipped";
  EXPECT_DOUBLE_EQ(e.shown_psnr, 120) << "a screen shows neither what is above white nor what is below black";
  EXPECT_EQ(e.median_log, 0);
  const RadianceError dark = rays.error({0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f}, {0});
  EXPECT_NEAR(dark.median_log, std::log(0.26 / 1.01), kRounding) << "below 0: too dark";
  EXPECT_NEAR(dark.shown_psnr, -20 * std::log10(1 - std::pow(0.25, 1 / 2.2)), 10 * kRounding);
  EXPECT_NEAR(alike.error(answer, {0, 1}).relmse, (first + second) / 6, kRounding);
  EXPECT_NEAR(rays.error(answer, {1}).relmse, second / 3, kRounding);
  EXPECT_NEAR(rays.noise({0.4f, 0.2f, 0, 0, 0, 0}, {0, 1}), (0.4f / 1.01 + 3 * (0.2f / 0.01)) / 12, kRounding);
}

TEST(LightErrors, NoConstantIsBetterThanTheBest) {
  std::vector<std::array<float, 3>> truth;
  std::vector<double> weights;
  KnownRays::Used all;
  for (std::size_t i = 0; i < 9; ++i) {
    const auto t = static_cast<float>(i);
    truth.push_back({0.1f * t, 0.05f * t * t, 1 / (1 + t)}), weights.push_back(1 + 0.3 * std::sin(t)), all.push_back(i);
  }
  const KnownRays rays(truth, weights);
  const RadianceError best = rays.best_constant(all);
  const auto constant = [&](std::array<double, 3> rgb) {
    std::vector<float> planar;
    for (const double v : rgb) planar.insert(planar.end(), truth.size(), static_cast<float>(v));
    return rays.error(planar, all);
  };
  RadianceError least = constant({0, 0, 0});
  for (double r = 0; r < 1; r += 0.02)
    for (double g = 0; g < 3; g += 0.05)
      for (double b = 0; b < 1; b += 0.02) {
        const RadianceError e = constant({r, g, b});
        for (const auto error : {&RadianceError::relmse, &RadianceError::log_rmse, &RadianceError::smape})
          least.*error = std::min(least.*error, e.*error);
        for (const auto level : {&RadianceError::psnr, &RadianceError::shown_psnr})
          least.*level = std::max(least.*level, e.*level);
      }
  for (const auto error : {&RadianceError::relmse, &RadianceError::log_rmse, &RadianceError::smape}) {
    EXPECT_LE(best.*error, least.*error);
    EXPECT_GT(best.*error, 0.95 * (least.*error)) << "the grid's steps are not that coarse";
  }
  for (const auto level : {&RadianceError::psnr, &RadianceError::shown_psnr}) {
    EXPECT_GE(best.*level, least.*level);
    EXPECT_LT(best.*level, least.*level + 0.1);
  }
  EXPECT_NEAR(best.median_log, 0, kRounding);
}

TEST(LightErrors, AnglesAndRanges) {
  const KnownRays rays({{1, 0, 0}, {1, 1, 0}, {1, 1, 1}});
  const std::vector<float> answer{0, 2, 0, 5, 2, 0, 0, 0, 0};  // at a right angle, the same direction, black
  EXPECT_NEAR(rays.angle(answer, {0}), 90, kRounding);
  EXPECT_NEAR(rays.angle(answer, {1}), 0, 1e-5);  // acos near 1 loses half the digits
  EXPECT_NEAR(rays.angle(answer, {2}), 90, kRounding);
  EXPECT_NEAR(rays.angle(answer, {0, 1, 2}), 60, 1e-5);
  // Grey values 0 .. 99, all of one weight: 1 % of it is reached at the first value, 99 % at the 99th, which is 98.
  std::vector<float> grey;
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < 100; ++i) grey.push_back(static_cast<float>(99 - i));
  const std::vector<double> alike(100, 1.0);
  EXPECT_NEAR(log_intensity_range(grey, alike), std::log(98.01 / 0.01), kRounding);
  std::vector<double> last = alike;
  last[99] = 1e-6;  // value 0 hardly counts: 1 % is reached at value 1, 99 % at value 99
  EXPECT_NEAR(log_intensity_range(grey, last), std::log(99.01 / 1.01), kRounding);
}

TEST(LightErrors, ShareOfTheWay) {
  EXPECT_NEAR(way_gone(1.1, 0.6, 0.1), 0.5, kRounding);
  EXPECT_NEAR(way_gone(1.1, 0.1, 0.1), 1, kRounding) << "nothing but the noise is left";
  EXPECT_LT(way_gone(1.1, 1.5, 0.1), 0) << "further away than the simple answer";
  EXPECT_TRUE(std::isnan(way_gone(0.1, 0.05, 0.1)));
}

TEST(Detection, SpreadIsTheLargerOfSeedsAndRooms) {
  // Means of rooms 2, 4 and 6: standard deviation 2, error 2 / sqrt(3). Seeds' means 3 and 5: deviation sqrt(2).
  const Measure m = over_rooms({{1, 3}, {3, 5}, {5, 7}, {NAN, 1}});
  EXPECT_NEAR(m.mean, 4, kRounding);
  EXPECT_NEAR(m.deviation, std::sqrt(2.0), kRounding);
  EXPECT_EQ(m.count, 3) << "a room without a value is left out";
  EXPECT_NEAR(over_rooms({{2, 2}, {4, 4}, {6, 6}}).deviation, 2 / std::sqrt(3.0), kRounding);
  EXPECT_THROW(over_rooms({{NAN}}), Error);
}

TEST(Detection, AreaUnderTheCurve) {
  const std::vector<bool> labels{false, false, true, true};
  EXPECT_EQ(area_under_curve({0.1, 0.2, 0.3, 0.4}, labels), 1);
  EXPECT_EQ(area_under_curve({0.4, 0.3, 0.2, 0.1}, labels), 0);
  EXPECT_EQ(area_under_curve({0.1, 0.4, 0.35, 0.8}, labels), 0.75);  // three of four pairs are in order
  EXPECT_EQ(area_under_curve({0, 0, 0, 0}, labels), 0.5);
  EXPECT_EQ(area_under_curve({0, 0.5, 0.5, 1}, labels), 0.875);  // one of four pairs is a tie
  EXPECT_TRUE(std::isnan(area_under_curve({0.1, 0.2}, {true, true})));
  EXPECT_TRUE(std::isnan(area_under_curve({}, {})));
}

TEST(Detection, Reliability) {
  const auto bins = reliability_bins({0, 0.1, 0.5, 0.9, 1}, {false, true, true, true, false}, 2);
  ASSERT_EQ(bins.size(), 2u);
  EXPECT_EQ(bins[0].count, 2);
  EXPECT_EQ(bins[1].count, 3);
  EXPECT_EQ(bins[0].positive, 1);
  EXPECT_EQ(bins[1].positive, 2);
  EXPECT_NEAR(bins[0].score, 0.1, kRounding);
  EXPECT_NEAR(bins[1].score, 2.4, kRounding);
  EXPECT_NEAR(calibration_error(bins), (0.9 + 0.4) / 5, kRounding);
  EXPECT_EQ(calibration_error(reliability_bins({0, 1}, {false, true}, 10)), 0);
  EXPECT_TRUE(std::isnan(calibration_error(reliability_bins({}, {}, 3))));
}

TEST(Detection, DifferencesInsideTheSpreadAreNone) {
  // Seeds scatter by 0.1 around differences of 1: means over rooms 0.9, 1, 1.1.
  const PairedDifference clear = paired_difference({{1.9, 2, 2.1}, {2.9, 3, 3.1}}, {{1, 1, 1}, {2, 2, 2}});
  EXPECT_NEAR(clear.mean, 1, kRounding);
  EXPECT_NEAR(clear.spread, 0.1, kRounding);
  EXPECT_STREQ(clear.verdict(), "higher");
  EXPECT_STREQ(paired_difference({{1, 1, 1}, {1, 1, 1}}, {{1.9, 2, 2.1}, {1.9, 2, 2.1}}).verdict(), "lower");
  EXPECT_STREQ(paired_difference({{1, 1.2, 1.1}, {1, 1.2, 1.1}}, {{1, 1, 1}, {1, 1, 1}}).verdict(), "none");
  EXPECT_STREQ(paired_difference({{1, 1, 1}}, {{1.9, 2, 2.1}}).verdict(), "one room");
  // All seeds agree and the rooms do not: 2 and -1, a mean of 0.5 with a standard error of 1.5.
  const PairedDifference rooms = paired_difference({{3, 3}, {0, 0}}, {{1, 1}, {1, 1}});
  EXPECT_NEAR(rooms.spread, 1.5, kRounding);
  EXPECT_STREQ(rooms.verdict(), "none");
  EXPECT_EQ(paired_difference({{NAN, 1}, {3, 3}}, {{1, 1}, {1, 1}}).mean, 2) << "a room without such rays";
  EXPECT_THROW(paired_difference({{NAN, 1}}, {{1, 1}}), Error);
}

/// A wall two metres ahead, facing the camera.
LightView wall() {
  LightView view;
  view.camera = Camera::from_fov(32, 24, 90);
  view.true_depth = Image(32, 24, 1, 2), view.true_normal = Image(32, 24, 3);
  std::fill_n(view.true_normal.plane(2), 32 * 24, 1.f);
  return view;
}

TEST(Uncertainty, RealHits) {
  LightView view = wall();
  const int pixel = 12 * 32 + 16;
  const Vec3 point = view.camera.unproject(16.5, 12.5, 2);
  const double side = 2 / view.camera.fx;  // metres of a pixel: the pixel looks almost straight at the wall
  EXPECT_TRUE(is_real_hit(view, pixel, point, 0.01));
  EXPECT_TRUE(is_real_hit(view, pixel, point + Vec3(1.4 * side, 0, 0), 1.5));
  EXPECT_FALSE(is_real_hit(view, pixel, point + Vec3(1.6 * side, 0, 0), 1.5));
  EXPECT_FALSE(is_real_hit(view, pixel, point + Vec3(0, 0, 0.5), 1.5)) << "something before the wall";
  EXPECT_FALSE(is_real_hit(view, pixel, Vec3(std::numeric_limits<double>::infinity()), 1e6)) << "nothing at all";
  // A surface seen at a slant of 60 degrees shows twice as much of itself.
  std::fill_n(view.true_normal.plane(0), 32 * 24, static_cast<float>(std::sqrt(0.75)));
  std::fill_n(view.true_normal.plane(2), 32 * 24, 0.5f);
  EXPECT_TRUE(is_real_hit(view, pixel, point + Vec3(2.5 * side, 0, 0), 1.5));
  view.true_depth.data[pixel] = 0;
  EXPECT_FALSE(is_real_hit(view, pixel, point, 1e6)) << "the pixel shows nothing";
}

TEST(Uncertainty, MixedLight) {
  const std::vector<float> in{1, 1, 1, 2, 2, 2, 3, 3, 3}, out{5, 5, 5, 6, 6, 6, 7, 7, 7}, delta{0, 0.05f, 0};
  const std::vector<int> pixel{4, 4, -1};  // a sure hit, an unsure one, a miss
  const std::vector<float> mixed = mixed_light(in, out, delta, pixel, 10);
  const double u = std::tanh(0.5);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(mixed[3 * c], in[3 * c]);
    EXPECT_NEAR(mixed[3 * c + 1], in[3 * c + 1] + 4 * u, 0x1p-22 * 7);  // float
    EXPECT_EQ(mixed[3 * c + 2], out[3 * c + 2]);
  }
  EXPECT_LT(mixed_light(in, out, delta, pixel, 1)[1], mixed[1]);
}

// --- Studies
// ----------------------------------------------------------------------------------------------------------

constexpr int kWidth = 64, kHeight = 48;

struct LightStudies : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    folder_ = std::make_unique<ScratchFolder>("clerestory-light-studies");
    write_untrained_light(weights(), {kWidth, kHeight});
  }
  static void TearDownTestSuite() { folder_.reset(), set_quiet(false); }

  static fs::path weights() { return *folder_ / "weights"; }

  static Config config(const std::string& kind, const std::string& root, std::vector<std::string> more = {}) {
    std::vector<std::string> all{"study.kind=" + kind,
                                 "study.seeds=2",
                                 "run.root=" + (*folder_ / root).string(),
                                 "light.weights=" + weights().string(),
                                 fmt::format("data.width={}", kWidth),
                                 fmt::format("data.height={}", kHeight),
                                 "data.rooms=2",
                                 "data.spp=4",
                                 "incident.views=1",
                                 "incident.points=10",
                                 "incident.ray_spp=2",
                                 "incident.probes=1",
                                 "incident.probe_spp=1"};
    all.insert(all.end(), more.begin(), more.end());
    return Config(study_schema(kind), all);
  }
  static fs::path run(const Config& c) { return run_study(c, {"clerestory", "run"}); }

  static double value(const MetricRecord& record, const Finding& finding) {
    Findings found;
    found.add_room(record, "metrics.jsonl");
    return found.value(0, finding).value();
  }
  /// Records without what depends on the clock.
  static std::vector<std::pair<std::string, double>> lasting(const MetricRecord& record) {
    auto values = record.values;
    std::erase_if(values, [](const auto& v) { return v.first.starts_with("seconds"); });
    return values;
  }
  static inline std::unique_ptr<ScratchFolder> folder_;
};

TEST_F(LightStudies, WhoAnswersAndGoesOnWhereItStopped) {
  const fs::path whole = run(config("light", "light"));
  const std::vector<MetricRecord> records = read_metrics(whole / "metrics.jsonl");
  ASSERT_EQ(records.size(), 2u);
  for (const MetricRecord& record : records) {
    for (const char* seed : {"0", "1"}) {
      // No constant is better than the best one; SSRT alone is black where it misses, which is an answer too.
      for (const char* kind : {"misses", "all"})
        for (const char* metric : {"relmse", "log_rmse"})
          EXPECT_LE(value(record, {metric, kind, "oracle", "", seed}), value(record, {metric, kind, "ssrt", "", seed}));
      // On a miss full is out of view alone, but for the rounding of nets in one kernel and in another.
      const double net = value(record, {"relmse", "misses", "net", "", seed});
      EXPECT_NEAR(net, value(record, {"relmse", "misses", "out_of_view", "", seed}), 1e-4 * net);
    }
    EXPECT_NE(value(record, {"relmse", "all", "net", "", "0"}), value(record, {"relmse", "all", "net", "", "1"}))
        << "the same rays";
    EXPECT_GT(value(record, {"range", "probes", "truth", "", "v0p0"}), 0);
    EXPECT_GE(value(record, {"distance", "probes", "", "", "v0p0"}), 0.15);
    EXPECT_TRUE(std::isfinite(value(record, {"way gone", "misses", "", "", "0"})));
  }
  const std::vector<FileRecord> inputs = read_provenance(whole / "provenance.json").inputs;
  ASSERT_EQ(inputs.size(), 4u) << "maps are true: the list of rooms, the rooms and the light's weights alone";
  EXPECT_EQ(inputs[2].hash, file_hash(weights() / "light_local.safetensors"));
  EXPECT_EQ(inputs[3].hash, file_hash(weights() / "light_global.safetensors"));
  const RunTables tables = study_tables(whole);
  EXPECT_EQ(tables.at("1_ablation").rows.size(), 27u);
  EXPECT_EQ(tables.at("2_differences").rows.size(), 24u);
  EXPECT_EQ(tables.at("3_probes").rows.size(), 11u);
  EXPECT_GE(tables.at("4_way").rows.size(), 2u);
  EXPECT_GE(tables.at("5_distance").rows.size(), 10u) << "surfaces, and probes of a bin or two";
  const Measure net = std::get<Measure>(tables.at("1_ablation").rows[18][5]);  // all rays, full: relMSE
  EXPECT_EQ(net.count, 2);
  EXPECT_NEAR(
      net.mean,
      (value(records[0], {"relmse", "all", "net", "", "0"}) + value(records[0], {"relmse", "all", "net", "", "1"}) +
       value(records[1], {"relmse", "all", "net", "", "0"}) + value(records[1], {"relmse", "all", "net", "", "1"})) /
          4,
      1e-12 * net.mean);
  EXPECT_TRUE(std::holds_alternative<Measure>(tables.at("3_probes").rows[9][4])) << "the other room's mean panorama";
  EXPECT_TRUE(fs::exists(whole / "report.html"));

  // The same run, killed after its first room.
  const fs::path part = *folder_ / "resumed";
  fs::copy(*folder_ / "light", part, fs::copy_options::recursive);
  const fs::path again = part / fs::relative(whole, *folder_ / "light");
  cut_metrics(again / "metrics.jsonl", 1);
  fs::remove(again / "DONE"), fs::remove_all(again / "artifacts");
  EXPECT_EQ(fs::canonical(run(config("light", "resumed"))), fs::canonical(again));
  const std::vector<MetricRecord> resumed = read_metrics(again / "metrics.jsonl");
  ASSERT_EQ(resumed.size(), 2u);
  EXPECT_EQ(lasting(resumed[1]), lasting(records[1]));
  EXPECT_EQ(read_file(again / "artifacts/4_way.table.json"), read_file(whole / "artifacts/4_way.table.json"));
}

TEST_F(LightStudies, Uncertainty) {
  const fs::path folder = run(config("uncertainty", "uncertainty", {"uncertainty.constants=[1, 10]"}));
  const std::vector<MetricRecord> records = read_metrics(folder / "metrics.jsonl");
  ASSERT_EQ(records.size(), 2u);
  for (const MetricRecord& record : records) {
    double rays[2] = {0, 0}, u[2] = {0, 0};
    for (int b = 0; b < 10; ++b)
      for (const int k : {0, 1}) {
        const auto bin = [&](const char* metric) {
          return value(record, Finding{metric, "bins of u", k ? "constant 10" : "constant 1"}.of(b));
        };
        rays[k] += bin("rays"), u[k] += bin("u");
        EXPECT_LE(bin("false"), bin("rays"));
      }
    EXPECT_GT(rays[0], 20);
    EXPECT_EQ(rays[0], rays[1]) << "all hits, whatever the constant";
    EXPECT_GT(u[1], u[0]) << "a larger constant is less sure";
    const double hits =
        value(record, {"share", "rays that hit", "", "", "0"}) + value(record, {"share", "rays that hit", "", "", "1"});
    EXPECT_EQ(std::lround(160 * hits), std::lround(rays[0]));
    EXPECT_LT(value(record, {"share", "false hits", "", "", "0"}), 0.9) << "rays of SSRT that are hardly ever right";
  }
  // At Eq. 6's own constant the nets of training, mixed afterwards, are those of inference. The latter leave out parts
  // of less than a thousandth.
  const std::vector<MetricRecord> asked = read_metrics(run(config("light", "light")) / "metrics.jsonl");
  for (std::size_t r = 0; r < records.size(); ++r)
    for (const std::string kind : {"hits", "all"}) {
      const double inference = value(asked.at(r), {"relmse", kind, "net", "", "1"});
      EXPECT_NEAR(value(records[r], {"relmse", kind, "constant 10", "", "1"}), inference, 0.01 * inference);
    }
  const RunTables tables = study_tables(folder);
  EXPECT_EQ(tables.at("2_constants").rows.size(), 2u);
  EXPECT_EQ(tables.at("1_detection").rows.size(), 1u);
  EXPECT_THAT(read_file(folder / "artifacts/reliability.svg"), testing::HasSubstr("constant 10"));
}

TEST_F(LightStudies, KnownLightIsTheTracersAndTheSameAgain) {
  const RoomAssets assets = load_assets(default_assets(), Setting::Training);
  LitRoomOptions o = lit_room_options(config("light", "unused"));
  o.seeds = 2, o.probe_spp = 8;
  LitRoom room(Device::open(), {0, 77, Setting::Training, assets}, o);
  const KnownView known = room.view(0), again = room.view(0);
  EXPECT_EQ(known.view.image.data, again.view.image.data);
  ASSERT_EQ(known.draws.size(), 2u);
  EXPECT_EQ(known.draws[1].light, again.draws[1].light);
  EXPECT_NE(known.draws[0].light, known.draws[1].light);
  EXPECT_NEAR(luminance_quantile(known.view.image.data, 0.95), 0.9, 0.9 * 8 * kFloatRounding);
  ASSERT_EQ(known.noise.size(), known.view.probes.size());
  EXPECT_GT(sum(known.noise.at(0).data), 0);

  const std::vector<Vec3> met = room.first_surfaces(known, known.draws[0]);
  double lit = 0, before = 0, nearer = 0, seen = 0;
  for (std::size_t i = 0; i < met.size(); ++i) {
    ASSERT_TRUE(std::isfinite(met[i].x)) << "a room is closed";
    if (const auto at = known.view.camera.project(met[i]);
        at && at->x >= 0 && at->y >= 0 && at->x < kWidth && at->y < kHeight) {
      const double ratio = -met[i].z / known.view.depth.at(0, static_cast<int>(at->y), static_cast<int>(at->x));
      ++before, nearer += ratio < 0.9, seen += std::abs(ratio - 1) < 0.1;
    }
    for (const float v : known.draws[0].light[i]) lit += v > 0;
  }
  EXPECT_GT(before, 20);
  EXPECT_LT(nearer, 0.1 * before) << "nothing stands before what the camera sees, but for the edges in a pixel";
  EXPECT_GT(seen, 0.2 * before);
  EXPECT_GT(lit, 1.5 * static_cast<double>(met.size())) << "of three channels each";

  // Predicted maps and a picture as a camera has it: the truth stays as it is, and leaves the true surfaces.
  o.predicted = o.clipped = true;
  LitRoom guessed(Device::open(), {0, 77, Setting::Training, assets}, o);
  const KnownView predicted = guessed.view(0);
  EXPECT_NE(predicted.view.depth.data, known.view.depth.data);
  EXPECT_EQ(predicted.view.true_depth.data, known.view.true_depth.data);
  EXPECT_EQ(predicted.draws[0].light, known.draws[0].light) << "clipped with the picture, or traced from elsewhere";
  for (std::size_t i = 0; i < known.view.image.data.size(); ++i)
    ASSERT_EQ(predicted.view.image.data[i], std::min(known.view.image.data[i], 1.f));
  EXPECT_TRUE(std::ranges::equal(predicted.view.emission.data, emission_flags(predicted.view.image).data));
  EXPECT_THAT(predicted.note, testing::HasSubstr("maps.safetensors"));
}

TEST_F(LightStudies, Refuse) {
  const auto refused = [&](const Config& c) -> std::string {
    try {
      run(c);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      return e.what();
    }
    ADD_FAILURE() << "not refused";
    return {};
  };
  ::setenv("CLERESTORY_LIGHT_WEIGHTS", folder_->path().c_str(), 1);
  EXPECT_THAT(refused(config("light", "refused", {"light.weights="})), testing::HasSubstr("no weights of the light"));
  ::unsetenv("CLERESTORY_LIGHT_WEIGHTS");
  EXPECT_THAT(refused(config("uncertainty", "refused", {"data.width=80", "data.height=60"})),
              testing::HasSubstr("another size than the light's nets read"));
  EXPECT_THAT(refused(config("light", "refused", {"incident.directions=20"})), testing::HasSubstr("multiple of 16"));
}

}  // namespace
}  // namespace clerestory
