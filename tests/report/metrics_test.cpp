#include "host/report/metrics.hpp"

#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <cmath>
#include <limits>

#include "host/error.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

class MetricsTest : public InTemporaryFolder {
 protected:
  std::filesystem::path path() const { return folder_ / "metrics.jsonl"; }
};

TEST_F(MetricsTest, WhatIsWrittenIsRead) {
  const double third = 1.0 / 3;
  {
    MetricsWriter writer(path());
    writer.write(1, {{"train/loss", third}, {"odd \"name\"", -2e-300}});
    writer.write(2, {{"train/loss", std::nan("")}, {"val", std::numeric_limits<double>::infinity()}});
  }
  const auto records = read_metrics(path());
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[0].step, 1);
  EXPECT_EQ(records[0].values[0], std::make_pair(std::string("train/loss"), third)) << "to the bit";
  EXPECT_EQ(records[0].values[1], std::make_pair(std::string("odd \"name\""), -2e-300));
  EXPECT_TRUE(std::isnan(records[1].values[0].second));
  EXPECT_TRUE(std::isnan(records[1].values[1].second));
  EXPECT_LE(records[0].seconds, records[1].seconds);
  EXPECT_EQ(metric_names(records), (std::vector<std::string>{"train/loss", "odd \"name\"", "val"}));
  EXPECT_EQ(curve_of(records, "train/loss").steps, (std::vector<double>{1, 2}));
  EXPECT_TRUE(read_metrics(folder_ / "none.jsonl").empty());
}

TEST_F(MetricsTest, TornLastLineIsDroppedAndTimeGoesOn) {
  put(path(), "{\"step\":1,\"seconds\":100.5,\"a\":1}\n{\"step\":2,\"seconds\":20");
  EXPECT_EQ(read_metrics(path()).size(), 1u);
  {
    MetricsWriter writer(path());
    EXPECT_GE(writer.seconds(), 100.5);
    EXPECT_LT(writer.seconds(), 160.5);
    writer.write(2, {{"a", 2}});
  }
  const auto records = read_metrics(path());
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[1].values[0].second, 2);
  EXPECT_GE(records[1].seconds, 100.5);
}

TEST_F(MetricsTest, BrokenLineInTheMiddleNamesItsNumber) {
  put(path(), "{\"step\":1,\"seconds\":1}\nrubbish\n{\"step\":3,\"seconds\":3}\n");
  try {
    read_metrics(path());
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("metrics.jsonl:2"), std::string::npos) << error.what();
  }
}

TEST_F(MetricsTest, CutKeepsLinesUpToTheStepByteForByte) {
  const std::string kept = "{\"step\":1,\"seconds\":1.25,\"a\":1}\n{\"step\":2,\"seconds\":2.5,\"a\":2}\n";
  put(path(), kept + "{\"step\":3,\"seconds\":3,\"a\":3}\n{\"step\":4,\"sec");
  cut_metrics(path(), 2);
  EXPECT_EQ(text_of(path()), kept);
  cut_metrics(path(), 0);
  EXPECT_EQ(text_of(path()), "");
  cut_metrics(folder_ / "none.jsonl", 5);  // nothing to cut is no error
}

TEST_F(MetricsTest, KilledWriterLeavesWholeRecords) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    MetricsWriter writer(path());
    for (std::int64_t step = 1;; ++step) writer.write(step, {{"loss", 1.0 / static_cast<double>(step)}});
  }
  while (!std::filesystem::exists(path()) || std::filesystem::file_size(path()) < 4096) usleep(1000);
  ASSERT_EQ(kill(child, SIGKILL), 0);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  const auto records = read_metrics(path());
  ASSERT_GT(records.size(), 50u);
  for (std::size_t i = 0; i < records.size(); ++i) ASSERT_EQ(records[i].step, static_cast<std::int64_t>(i) + 1);
}

TEST_F(MetricsTest, ThinnedCurvesAreMeansOfRuns) {
  const double nan = std::nan("");
  const Curve thin = thinned({{1, 2, 3, 4, 5, 6, 7}, {1, 3, nan, 5, nan, nan, 9}}, 4);
  EXPECT_EQ(thin.steps, (std::vector<double>{1.5, 3.5, 5.5, 7}));
  EXPECT_EQ(thin.values[0], 2);
  EXPECT_EQ(thin.values[1], 5);
  EXPECT_TRUE(std::isnan(thin.values[2]));
  EXPECT_EQ(thin.values[3], 9);
  EXPECT_EQ(thinned({{1, 2}, {3, 4}}, 2).values, (std::vector<double>{3, 4}));
}

TEST_F(MetricsTest, NoSpaceIsAnErrorAndTheFileStaysReadable) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // A limit on file size stands in for a full disk: the write that crosses it is cut short, the next one fails.
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    MetricsWriter writer(path());
    try {
      for (int step = 1; step < 1000; ++step) writer.write(step, {{"loss", 0.5}});
    } catch (const Error& error) {
      _exit(error.kind() == ErrorKind::Failed ? 7 : 8);
    }
    _exit(9);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_GT(read_metrics(path()).size(), 10u);
}

TEST_F(MetricsTest, BadPathsAreErrors) {
  EXPECT_THROW(MetricsWriter(folder_ / "no/such/folder/metrics.jsonl"), Error);
  EXPECT_THROW(MetricsWriter{folder_}, Error);
}

}  // namespace
}  // namespace clerestory
