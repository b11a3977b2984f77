// `clerestory tune`: which sets it tries, that wrong ones are refused, that it goes on where it was, and what it keeps.
#include "experiments/bench/tune.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "experiments/bench/clblast_search.hpp"
#include "experiments/bench/tune_trials.hpp"
#include "host/ops/nn/clblast_parameters.hpp"
#include "tests/cl/environment.hpp"
#include "tests/experiments/program.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

const ClblastValues kOwnXgemm{{"GEMMK", 0}, {"KREG", 1},  {"KWG", 32},  {"KWI", 2},  {"MDIMA", 16}, {"MDIMC", 16},
                              {"MWG", 64},  {"NDIMB", 8}, {"NDIMC", 8}, {"NWG", 64}, {"SA", 0},     {"SB", 0},
                              {"STRM", 0},  {"STRN", 0},  {"VWM", 4},   {"VWN", 4}};
const ClblastValues kOwnDirect{{"KWID", 2}, {"MDIMAD", 8}, {"MDIMCD", 8}, {"NDIMBD", 8}, {"NDIMCD", 8},
                               {"PADA", 1}, {"PADB", 1},   {"VWMD", 4},   {"VWND", 4},   {"WGD", 32}};

/// Searches to its end where a set's gain is known, as if it was measured.
template <class Gain>
ClblastSearch searched(const std::string& kernel, const ClblastValues& own, const Gain& gain) {
  ClblastSearch search{kernel, own, {}};
  while (const auto values = search.next()) {
    EXPECT_TRUE(valid_values(kernel, *values));
    for (const ClblastTrial& trial : search.trials) EXPECT_NE(trial.values, *values) << "tried twice";
    search.trials.push_back({*values, gain(*values), gain(*values), {}});
    if (search.trials.size() > 500) break;
  }
  return search;
}

TEST(ClblastSearch, BeginsWithClblastsOwnAndEndsWhereNoNeighbourIsBetter) {
  // Best with vectors of 2 along n, and 4 x 8 work-items: none of the known sets.
  const auto gain = [](const ClblastValues& v) {
    const auto off = [&](const char* name, double best) {
      return std::abs(std::log2(static_cast<double>(v.at(name)) / best));
    };
    return v.at("GEMMK") == 1
               ? 10 * std::exp(-0.1 * (off("VWN", 2) + off("MDIMC", 4) + off("NDIMC", 8) + off("VWM", 8)))
               : 1.0;
  };
  const ClblastSearch search = searched("Xgemm", kOwnXgemm, gain);
  EXPECT_EQ(search.trials.front().values, kOwnXgemm);
  EXPECT_LT(search.trials.size(), 200u);
  const ClblastValues best = search.best();
  EXPECT_EQ(best.at("VWN"), 2u);
  EXPECT_EQ(best.at("MDIMC"), 4u);
  EXPECT_EQ(best.at("MDIMA"), 4u);
  EXPECT_EQ(best.at("NDIMC"), 8u);
  EXPECT_EQ(best.at("VWM"), 8u);
  EXPECT_DOUBLE_EQ(search.best_gain(), 10);
}

TEST(ClblastSearch, OfTheDirectKernelFindsSmallGroups) {
  const auto gain = [](const ClblastValues& v) { return 100.0 / static_cast<double>(v.at("MDIMCD")); };
  EXPECT_LT(searched("XgemmDirect", kOwnDirect, gain).best().at("MDIMCD"), 8u);
}

TEST(ClblastSearch, PassesOverWhatIsWrongAndWhatLosesSomewhere) {
  ClblastSearch search{"XgemmDirect", kOwnDirect, {}};
  search.trials.push_back({kOwnDirect, 1, 1, {}});
  ClblastValues wrong = kOwnDirect, loses = kOwnDirect, better = kOwnDirect;
  wrong["VWMD"] = 2, loses["VWMD"] = 1, better["VWND"] = 2;
  search.trials.push_back({wrong, 9, 9, "wrong"});
  search.trials.push_back({loses, 5, 0.8, {}});
  search.trials.push_back({better, 1.5, 1.2, {}});
  EXPECT_EQ(search.best(), better);
}

TEST(ClblastSearch, KnowsWhatClblastCannotCompileOrHasWrong) {
  EXPECT_TRUE(valid_values("Xgemm", kOwnXgemm));
  EXPECT_TRUE(valid_values("XgemmDirect", kOwnDirect));
  ClblastValues odd = kOwnXgemm, zero = kOwnXgemm, oblong = kOwnXgemm;
  odd["VWM"] = 8, zero["MDIMC"] = 0;
  EXPECT_FALSE(valid_values("Xgemm", odd)) << "64 is no multiple of 16 work-items times vectors of 8";
  EXPECT_FALSE(valid_values("Xgemm", zero));
  for (const auto& [name, value] : ClblastValues{{"GEMMK", 1}, {"KWG", 1}, {"KWI", 1}, {"KREG", 4}})
    oblong[name] = value;
  EXPECT_TRUE(valid_values("Xgemm", oblong));
  oblong["NWG"] = 32;
  EXPECT_FALSE(valid_values("Xgemm", oblong)) << "CLBlast 1.5.3 is wrong with it";
}

TEST(IndirectFrom, IsWhereTheIndirectKernelBeginsToWin) {
  const std::vector<DirectOrNot> products{{1e6, 1, 2}, {27e6, 1, 1.5}, {216e6, 2, 1}, {1e9, 3, 1}};
  EXPECT_EQ(indirect_from(products, 10), static_cast<std::size_t>(std::ceil(std::cbrt(std::sqrt(27e6 * 216e6)))));
  EXPECT_EQ(indirect_from(products, 576), 576u) << "CLBlast's own is as good";
  EXPECT_EQ(indirect_from({{1e6, 2, 1}, {1e9, 2, 1}}, 576), 1u);
  EXPECT_EQ(indirect_from({}, 576), 576u);
}

// On a device: two sets of each kernel and one product, some twenty seconds of CLBlast's compiling without a cache.
struct Tune : testing::Test {
  Device device = Device::open();  // first: PoCL keeps to the cache that it has found
  ScopedFolder folder;
  ScopedVariable data{"XDG_DATA_HOME", folder.string()}, cache{"XDG_CACHE_HOME", folder.string()};
  ScopedVariable nothing_shipped{"CLERESTORY_DATA", folder.string()};
  ~Tune() override { use_clblast_parameters(device, {}); }

  static TuneOptions few(int sets) {
    TuneOptions options;
    options.most_sets = sets, options.rounds = 1;
    options.large = {{64, 2048, 1600}}, options.small = {{33, 64, 31, true}};
    options.products = {{64, 64, 64}};
    options.layers = {{{1, 8, 8, 8}, {8, 8, 3, 3}}};
    return options;
  }
};

// One whose tile its vectors do not divide, and one that lacks a parameter.
TEST_F(Tune, AWrongSetIsRefusedByItsResult) {
  ClblastMeter meter(device, few(1).small, 1);
  EXPECT_EQ(meter.measure({})[0].fault, "");
  ClblastParameters wrong = clblast_defaults(device);
  wrong["XgemmDirect"] = kOwnDirect;                                   // CLBlast's own differ by device
  wrong["XgemmDirect"]["WGD"] = 16, wrong["XgemmDirect"]["VWMD"] = 4;  // 16 is no multiple of 8 work-items of 4
  EXPECT_FALSE(valid_values("XgemmDirect", wrong["XgemmDirect"]));
  EXPECT_NE(meter.measure(wrong)[0].fault, "");
  wrong = clblast_defaults(device);
  wrong["XgemmDirect"].erase("WGD");
  EXPECT_THAT(meter.measure(wrong)[0].fault, HasSubstr("XgemmDirect"));
  EXPECT_THAT(message_of<Error>([&] { use_clblast_parameters(device, {{"Xgemv", {}}}); }), HasSubstr("Xgemv"));
}

TEST_F(Tune, GoesOnWhereItWasAndKeepsWhatItFound) {
  const Tuning first = tune(device, few(1));
  EXPECT_FALSE(first.complete);
  EXPECT_EQ(first.sets, 2);  // of each product's kernel CLBlast's own
  EXPECT_TRUE(first.clblast.empty());
  EXPECT_EQ(first.figures.size(), 4u);
  ASSERT_TRUE(tuning_in_use(device));
  EXPECT_EQ(tuning_json(tuning_in_use(device)->tuning), tuning_json(first));
  EXPECT_EQ(tuning_in_use(device)->tuning.gemm, preferred_gemm(device));

  const Tuning second = tune(device, few(1));
  EXPECT_EQ(second.sets, 4) << "the first call's were measured again, or forgotten";
  for (const TuningFigure& figure : second.figures) EXPECT_LE(figure.tuned, figure.untuned * 1.2) << figure.work;
  EXPECT_THAT(tuning_text(*tuning_in_use(device)), HasSubstr("the search is not over"));

  // A process that ended while it measured a set tries it again, and no third time.
  for (int ended = 0; ended < 2; ++ended) {
    TuneTrials trials(device, false);
    EXPECT_EQ(trials.sets(), 4);
    trials.begin({{"Xgemm", *trials.search("Xgemm").next()}});
  }
  TuneTrials after(device, false);
  ASSERT_EQ(after.sets(), 5);
  EXPECT_THAT(after.search("Xgemm").trials.back().fault, HasSubstr("ended twice"));
  EXPECT_EQ(TuneTrials(device, true).sets(), 0);
}

TEST_F(Tune, ADamagedFileIsAnErrorBeforeTheWork) {
  folder.write("clerestory/tuning.json", "{");
  const std::filesystem::path said = folder.path() / "said.txt";
  Program program({"tune", "--minutes", "0.01"}, said);
  EXPECT_EQ(program.wait(), 2);
  EXPECT_THAT(text_of(said), HasSubstr("clerestory/tuning.json"));
  std::filesystem::remove(folder.path() / "clerestory/tuning.json");
  Program show({"tune", "--show"}, said);
  EXPECT_EQ(show.wait(), 2);
  EXPECT_THAT(text_of(said), HasSubstr("nothing was measured"));
}

}  // namespace
}  // namespace clerestory
