// The study of error against time: its arithmetic on numbers made by hand, and a small room from config to tables.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/studies/error_time_figures.hpp"
#include "experiments/studies/error_time_study.hpp"
#include "experiments/studies/error_time_tables.hpp"
#include "experiments/studies/study.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/message_of.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

TEST(ErrorTimeFigures, SlopeOfAPowerIsItsExponent) {
  EXPECT_NEAR(*log_log_slope({1, 4, 16}, {3, 3.0 / 8, 3.0 / 64}), -1.5, 1e-14);
  EXPECT_NEAR(*log_log_slope({1, 4, 16, 64}, {2, 1, -1, 0.25}), -0.5, 1e-14)
      << "what is below 0 by chance is passed over";
  EXPECT_FALSE(log_log_slope({1, 4}, {1, -1})) << "one point has no slope";
  EXPECT_FALSE(log_log_slope({2, 2}, {1, 3})) << "nor have two above each other";
}

TEST(ErrorTimeFigures, TheFrontIsWhatNothingBeats) {
  //                                        slow, better; fast, worse; beaten by 1; equal to 1 in time, worse; equal to
  //                                        0
  const std::vector<double> seconds{4, 1, 2, 1, 4}, error{0.1, 0.5, 0.6, 0.7, 0.1};
  EXPECT_EQ(pareto_front(seconds, error), (std::vector<bool>{true, true, false, false, true}));
  EXPECT_EQ(pareto_front({2, 1}, {1, NAN}), (std::vector<bool>{true, false})) << "no number is on no front";
}

TEST(ErrorTimeFigures, SecondsToAnErrorLieOnTheLineInLogarithms) {
  const std::vector<double> seconds{1, 10, 100};
  const auto at = [&](double error, const std::vector<double>& errors) { return seconds_to(error, seconds, errors); };
  EXPECT_NEAR(std::get<Measure>(at(0.1, {1, 0.01, 1e-4})).mean, std::sqrt(10), 1e-12);
  EXPECT_NEAR(std::get<Measure>(at(0.01, {1, 0.01, 1e-4})).mean, 10, 1e-12);
  EXPECT_EQ(std::get<std::string>(at(2, {1, 0.01, 1e-4})), "< 1") << "before the first";
  EXPECT_EQ(std::get<std::string>(at(1e-5, {1, 0.01, 1e-4})), "> 1e+02") << "behind the last";
  EXPECT_EQ(std::get<std::string>(at(1e-5, {1, -0.01, 1e-4})), "< 10") << "below 0 by chance has no logarithm";
  EXPECT_EQ(std::get<std::string>(at(0.01, {NAN, NAN, NAN})), "> 1e+02") << "what is no number reaches nothing";
  EXPECT_FALSE(log_log_slope(seconds, {1, NAN, 0.01}));
}

TEST(ErrorTimeFigures, FactorsOfBoundsAreBoundsOrNothing) {
  const Cell four = Measure{4}, one = Measure{1}, over = std::string("> 3"), under = std::string("< 0.5");
  EXPECT_NEAR(std::get<Measure>(factor_of(four, one)).mean, 4, 1e-15);
  EXPECT_EQ(std::get<std::string>(factor_of(over, one)), "> 3");
  EXPECT_EQ(std::get<std::string>(factor_of(four, under)), "> 8");
  EXPECT_EQ(std::get<std::string>(factor_of(over, under)), "> 6");
  EXPECT_EQ(std::get<std::string>(factor_of(four, over)), "< 1.3");
  EXPECT_EQ(std::get<std::string>(factor_of(under, over)), "< 0.17");
  EXPECT_TRUE(std::holds_alternative<std::monostate>(factor_of(over, over)));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(factor_of(under, under)));
}

/// Runs of `size` values: 1 + bias + noise of that deviation, uniform, from a stream of its own each.
std::vector<Estimate> noisy(int runs, std::size_t size, double bias, double deviation, std::uint64_t stream) {
  std::vector<Estimate> all;
  for (int r = 0; r < runs; ++r) {
    Random random = Random(stream).fork(static_cast<std::uint64_t>(r));
    Estimate& one = all.emplace_back(size);
    for (double& v : one) v = 1 + bias + deviation * std::sqrt(12.0) * (static_cast<double>(random.unit()) - 0.5);
  }
  return all;
}

// 1000 pixels of 3 channels, 3 estimates, 2 runs of a truth as noisy as they are.
TEST(ErrorTimeFigures, BiasAndVarianceHoldNoNoiseOfTheTruth) {
  constexpr std::size_t pixels = 1000, size = 3 * pixels;
  const double deviation = 0.2, variance = deviation * deviation;
  const ErrorReference truth(noisy(2, size, 0, deviation, 1), std::vector<bool>(pixels, true), {});
  const auto z = [](const ErrorReference::Moments& m) { return m.bias / std::sqrt(m.bias_spread); };
  std::vector<double> unbiased, unshifted;
  int rejected = 0;
  const auto p_of = [](const ErrorReference::Moments& m) {
    return *p_of_shifts({{m.shift, {m.shift_spread, m.truth_spread}, {3, 2}}});
  };
  for (std::uint64_t k = 0; k < 200; ++k) {
    const ErrorReference own(noisy(2, size, 0, deviation, 100 + 2 * k), std::vector<bool>(pixels, true), {});
    const ErrorReference::Moments m = own.moments(noisy(3, size, 0, deviation, 101 + 2 * k));
    unbiased.push_back(z(m)), unshifted.push_back(m.shift);
    rejected += p_of(m) < 0.1;
  }
  // A standard normal's mean and deviation over 200 of them: 4 standard errors.
  EXPECT_NEAR(mean(unbiased), 0, 4 / std::sqrt(200));
  EXPECT_NEAR(standard_deviation(unbiased), 1, 4 / std::sqrt(400));
  // Sums over 3000 values, each over the root of 3000: the noise of one value, of three estimates less two truths.
  EXPECT_NEAR(standard_deviation(unshifted), std::sqrt(variance / 3 + variance / 2), 4 / std::sqrt(400) * deviation);

  // A tenth of 200, 4 deviations of the binomial; Welch's test of so few values rejects somewhat less.
  EXPECT_LE(rejected, 20 + 4 * std::sqrt(18));

  const std::vector<Estimate> biased = noisy(3, size, 0.1, deviation, 7);
  const ErrorReference::Moments m = truth.moments(biased);
  EXPECT_GT(z(m), 5);
  EXPECT_NEAR(m.shift, 0.1 * std::sqrt(size), 4 * deviation);
  EXPECT_NEAR(m.bias, 0.01, 4 * std::sqrt(m.bias_spread));
  // Of 9000 values' squares: 4 standard errors of a uniform number's variance, sqrt(0.8 / n) of it.
  EXPECT_NEAR(m.variance, variance, 4 * std::sqrt(0.8 / 9000) * variance);
  EXPECT_NEAR(truth.error(biased[0]), m.bias + m.variance, 0.15 * (m.bias + m.variance));
}

TEST(ErrorTimeFigures, PValuesTogetherAreFishers) {
  EXPECT_NEAR(*p_together({0.3}), 0.3, 1e-12);
  EXPECT_NEAR(*p_together({0.1, 0.1}), 0.01 * (1 - std::log(0.01)), 1e-12);
  EXPECT_EQ(*p_together({0.1, 0.0}), 0);
  EXPECT_FALSE(p_together({0.1, {}}));
}

TEST(ErrorTimeFigures, ErrorsCountOverUsedPixelsAndTheirOwnSize) {
  const ErrorReference truth({{1, 5, 3, 7}, {1, 5, 3, 7}}, {true, false}, 0.5);  // two pixels of two channels
  EXPECT_NEAR(truth.error({2, 1, 3, 0}), 0.5 * (1 / 1.5), 1e-15);
  EXPECT_THROW(ErrorReference({{1.0}}, {true}, 0.5), Error) << "one run has noise";
  EXPECT_THROW(ErrorReference({{1.0}, {1.0}}, {false}, 0.5), Error) << "no pixel";
}

TEST(ErrorTimeTables, CsvQuotesAndKeepsDigits) {
  Table table;
  table.columns = {{"who", ""}, {"error, all", "m"}};
  table.add({"a \"b\", c", Measure{1.0 / 3, 0.5, 3}});
  table.add({"d", Cell()});
  EXPECT_EQ(table_csv(table),
            "who,\"error, all [m]\",\"deviation of error, all [m]\"\n\"a \"\"b\"\", c\",0.333333333,0.5\nd,,\n");
}

Config error_time_config(const std::filesystem::path& root, std::vector<std::string> words) {
  words.insert(words.begin(), {"run.root=" + root.string(), "data.rooms=1", "data.width=32", "data.height=24"});
  return study_config(std::filesystem::path(CLERESTORY_SOURCE_DIR) / "experiments/configs/error_time.toml", words);
}

double number(const Table& table, std::size_t row, std::size_t column) {
  return std::get<Measure>(table.rows[row][column]).mean;
}

TEST(ErrorTimeStudy, AnUnbiasedEstimatorsErrorFallsAsOneOverItsSamples) {
  const ScratchFolder folder{"clerestory-error-time"};
  const Config config = error_time_config(
      folder.path(), {"data.spp=16", "pictures.samplers=[vndf_caps, guided]", "pictures.spp=[1, 4, 16, 64, 256]",
                      "pictures.truth_spp=8192", "gradients.draws=[]", "learned.switches=[]", "study.seeds=6"});
  const std::filesystem::path run = run_study(config, {"clerestory", "run"});
  const RunTables tables = study_tables(run);
  const Table &head = tables.at("error_time"), &rows = tables.at("pictures");
  ASSERT_EQ(head.rows.size(), 4u) << "two samplers with two points";
  ASSERT_EQ(rows.rows.size(), 4u * 5u);
  const std::vector<std::string> names{"vndf_caps, sobol", "guided, sobol", "vndf_caps, independent",
                                       "guided, independent"};
  for (std::size_t e = 0; e < names.size(); ++e) {
    EXPECT_EQ(std::get<std::string>(head.rows[e][2]), names[e]);
    EXPECT_LT(std::abs(number(head, e, 7)), 4) << names[e] << ": z of the bias";
    EXPECT_GT(number(head, e, 8), 1e-3) << names[e] << ": p of the sum";
    EXPECT_EQ(std::get<std::string>(head.rows[e][9]), "none seen") << names[e];
    const auto& slope = std::get<Measure>(head.rows[e][5]);
    if (names[e].ends_with("independent")) {
      // Its standard error over six seeds, known itself to a third: 4 of them.
      EXPECT_NEAR(slope.mean, -1, 4 * slope.deviation / std::sqrt(6)) << names[e];
      EXPECT_LT(slope.deviation, 0.3) << names[e] << ": the test sees nothing";
    }
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_EQ(number(rows, 5 * e + k, 1), std::pow(4, k));
      EXPECT_GT(number(rows, 5 * e + k, 5), 0) << "seconds";
      EXPECT_GT(number(rows, 5 * e + k, 12), 0) << "memory";
      EXPECT_GT(number(rows, 5 * e + k, 4), 0) << "FLIP";
      if (k > 0) {
        EXPECT_LT(number(rows, 5 * e + k, 2), number(rows, 5 * e + k - 1, 2)) << names[e] << " " << k;
      }
    }
  }
  for (std::size_t e = 0; e < names.size(); ++e)
    EXPECT_LT(number(rows, 5 * e + 4, 4), 0.7 * number(rows, 5 * e, 4))
        << "FLIP of 256 samples and of one, " << names[e];
  EXPECT_LT(number(head, 0, 6), 0.5 * number(head, 2, 6)) << "Sobol's points gain nothing";
  EXPECT_TRUE(std::filesystem::exists(run / "artifacts/pictures.csv"));
  EXPECT_TRUE(!can_plot() || std::filesystem::exists(run / "artifacts/pictures.svg"));
  EXPECT_THAT(read_file(run / "artifacts/error_time.csv"), HasSubstr("\"vndf_caps, sobol\""));
}

// One draw's bias is the covariance of the picture and its derivatives, of one sign in a map. Over 128 seeds the sums'
// distances are 32, -6 and -24 standard errors for albedo, roughness and metallic, and -0.7 to 1.7 with two draws.
TEST(ErrorTimeStudy, GradientsOfTwoDrawsAreUnbiasedAndThoseOfOneAreNot) {
  const ScratchFolder folder{"clerestory-error-time-gradients"};
  const Config config = error_time_config(
      folder.path(), {"data.spp=16", "pictures.samplers=[]", "learned.switches=[]", "gradients.spp=[1, 4, 16]",
                      "gradients.points=[independent]", "gradients.truth_spp=8192", "study.seeds=16",
                      "gradients.samplers=[vndf_caps]", "gradients.batches=1"});
  const RunTables tables = study_tables(run_study(config, {"clerestory", "run"}));
  const Table &head = tables.at("error_time"), &rows = tables.at("gradients");
  ASSERT_EQ(head.rows.size(), 5u * 2u);
  ASSERT_EQ(rows.rows.size(), 5u * 2u * 3u);
  for (std::size_t e = 0; e < head.rows.size(); ++e) {
    const std::string what = std::get<std::string>(head.rows[e][1]), who = std::get<std::string>(head.rows[e][2]);
    const double p = number(head, e, 8);
    if (who.starts_with("two")) {
      EXPECT_LT(std::abs(number(head, e, 7)), 4) << what;
      EXPECT_GT(p, 1e-3) << what;
    } else if (what == "albedo" || what == "metallic") {
      EXPECT_LT(p, 1e-6) << what;
      EXPECT_EQ(std::get<std::string>(head.rows[e][9]), "biased") << what;
    }
    EXPECT_LT(number(rows, 3 * e + 2, 3), number(rows, 3 * e, 3)) << what << ", " << who << ": error by samples";
  }
}

// Batches state what the spread over seeds is: of all values together, over 24 seeds.
TEST(ErrorTimeStudy, BatchesStateTheErrorThatGradientsHave) {
  const ScratchFolder folder{"clerestory-error-time-batches"};
  const Config config =
      error_time_config(folder.path(), {"data.spp=16", "pictures.samplers=[]", "learned.switches=[]",
                                        "gradients.spp=[4, 64]", "gradients.draws=[two]", "gradients.points=[sobol]",
                                        "gradients.samplers=[guided]", "gradients.truth_spp=4096", "study.seeds=24"});
  const Table rows = study_tables(run_study(config, {"clerestory", "run"})).at("gradients");
  ASSERT_EQ(rows.rows.size(), 5u * 2u * 2u);
  const std::size_t last = rows.columns.size() - 1;
  EXPECT_EQ(rows.columns[last].name, "stated");
  for (const auto& row : rows.rows) {
    const bool states = std::get<std::string>(row[0]).ends_with("8 batches") && std::get<Measure>(row[2]).mean == 64;
    ASSERT_EQ(std::holds_alternative<Measure>(row[last]), states) << "fewer samples than batches come at once";
    // Both are estimates of one expectation: half of the square is that of few bright pixels.
    if (states) {
      EXPECT_NEAR(std::get<Measure>(row[last]).mean, 1, 0.35) << std::get<std::string>(row[1]);
    }
  }
}

TEST(ErrorTimeStudy, LearnedLightHasARowForEachSwitch) {
  const ScratchFolder folder{"clerestory-error-time-learned"};
  const Config config =
      error_time_config(folder.path(), {"data.spp=16", "pictures.samplers=[]", "gradients.draws=[]", "study.seeds=2",
                                        "learned.spp=[4, 16]", "learned.truth_spp=256",
                                        "learned.switches=[default, shared, dda, independent, vndf_hemisphere]"});
  const RunTables tables = study_tables(run_study(config, {"clerestory", "run"}));
  const Table& rows = tables.at("learned");
  ASSERT_EQ(rows.rows.size(), 5u * 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_LT(number(rows, 2 * k + 1, 2), number(rows, 2 * k, 2));
    EXPECT_NEAR(number(rows, 2 + k, 2), number(rows, k, 2), 0.5 * number(rows, k, 2)) << "shared answers are close";
    EXPECT_NEAR(number(rows, 4 + k, 2), number(rows, k, 2), 0.5 * number(rows, k, 2)) << "dda meets the same cells";
  }
}

TEST(ErrorTimeStudy, PartsAreComparedWithThePlainEstimator) {
  const ScratchFolder folder{"clerestory-error-time-plain"};
  const Config config = error_time_config(
      folder.path(), {"data.spp=16", "pictures.samplers=[]", "gradients.draws=[]", "learned.switches=[]",
                      "study.seeds=2", "plain.lights=[image, net]", "plain_image.spp=[4, 64]",
                      "plain_image.truth_spp=1024", "plain_net.spp=[4, 16]", "plain_net.truth_spp=256"});
  const RunTables tables = study_tables(run_study(config, {"clerestory", "run"}));
  const Table& table = tables.at("by_part");
  std::vector<std::string> names;
  for (const auto& row : table.rows)
    names.push_back(std::get<std::string>(row[0]) + ": " + std::get<std::string>(row[1]));
  EXPECT_THAT(names,
              testing::ElementsAre("image: plain", "image: plain, but sampler", "image: plain, but points",
                                   "image: plain, but ssrt", "image: all on", "net: plain", "net: plain, but sampler",
                                   "net: plain, but points", "net: plain, but ssrt", "net: plain, but shared answers",
                                   "net: plain, but small shares", "net: all on"));
  const auto error = [&](std::size_t row) { return number(table, row, 6); };
  EXPECT_LT(error(4), 0.5 * error(0)) << "image: all parts gain nothing";
  EXPECT_LT(error(2), error(0)) << "Sobol's points gain nothing";
  // By random numbers of their own.
  EXPECT_NEAR(error(8), error(5), 0.5 * error(5)) << "dda meets the same cells";
  EXPECT_NEAR(error(10), error(5), 0.5 * error(5)) << "small shares change a thousandth at most";
  const auto whole = [&](std::size_t row) { return table.rows[row][4]; };
  for (std::size_t r = 0; r < table.rows.size(); ++r)
    if (std::holds_alternative<Measure>(table.rows[r][2])) {
      EXPECT_GT(std::get<Measure>(whole(r)).mean, number(table, r, 2)) << "the maps' nets take no time";
    }
}

TEST(ErrorTimeStudy, RefusesWhatItCannotMeasure) {
  const ScratchFolder folder{"clerestory-error-time-refused"};
  const auto refusal = [&](const std::vector<std::string>& words) {
    return message_of(
        [&] {
          run_study(error_time_config(folder.path(), words), {"clerestory", "run"});
        },
        ErrorKind::Usage);
  };
  EXPECT_THAT(refusal({"pictures.samplers=[vndf_cap]"}), HasSubstr("pictures.samplers"));
  EXPECT_THAT(refusal({"gradients.draw=[one]"}), HasSubstr("gradients.draws"));
  EXPECT_THAT(refusal({"pictures.spp=[4, 4]"}), HasSubstr("pictures.spp"));
  EXPECT_THAT(refusal({"pictures.points=[sobol, sobol]"}), HasSubstr("vndf_caps, sobol"));
  EXPECT_THAT(refusal({"gradients.truth_spp=1024"}), HasSubstr("gradients.truth_spp"));
  EXPECT_THAT(refusal({"study.seeds=1"}), HasSubstr("study.seeds"));
  EXPECT_THAT(refusal({"pictures.samplers=[]", "gradients.draws=[]", "learned.switches=[]"}),
              HasSubstr("nothing to measure"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "a refused run left something behind";
}

}  // namespace
}  // namespace clerestory
