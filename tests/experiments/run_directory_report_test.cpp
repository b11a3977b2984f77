// `clerestory report` of a run directory.
#include "experiments/studies/run_directory_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "experiments/studies/strip.hpp"
#include "host/error.hpp"
#include "host/io/image.hpp"
#include "host/report/metrics.hpp"
#include "host/report/plot.hpp"
#include "host/report/run_directory.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
using testing::Not;

class RunDirectoryReport : public testing::Test {
 protected:
  void SetUp() override {
    root_ = std::filesystem::temp_directory_path() / ("clerestory_run_report_" + std::to_string(getpid()));
    std::filesystem::remove_all(root_);
    Schema schema;
    schema.integer("width", 64, "Channels.");
    run_.emplace(root_, "study", "narrow", Config(schema), 1);
  }
  void TearDown() override {
    run_.reset();
    std::filesystem::remove_all(root_);
  }
  std::string report() const {
    write_run_directory_report(run_->path());
    std::ostringstream text;
    text << std::ifstream(*run_ / "report.html").rdbuf();
    return text.str();
  }

  std::filesystem::path root_;
  std::optional<RunDirectory> run_;
};

TEST_F(RunDirectoryReport, ShowsEverythingThatLiesThere) {
  Provenance provenance = begin_provenance({"clerestory", "run", "layer.toml"}, "PoCL");
  provenance.facts["sampler"] = "vndf_caps";
  write_provenance(*run_ / "provenance.json", provenance);
  {
    MetricsWriter metrics(run_->metrics_path());
    for (int step = 1; step <= 3000; ++step)
      metrics.write(step, {{"train/loss", 1.0 / step}, {"val/depth", 0.5}, {"rate", 1e-3}});
  }
  Table table{"Errors", {{"map", ""}, {"error", "", Best::Lowest}}, {}};
  table.add({std::string("albedo"), Measure{0.25}});
  std::ofstream(run_->artifact("errors.table.json")) << table_json(table);
  std::ofstream(run_->artifact("other.json")) << "{\"not\": \"a table\"}";
  Plot plot;
  plot.series = {{"curve of the artifact", {1, 2}, {3, 4}, {}, Stroke::Line}};
  write_plot(run_->artifact("error_against_time.svg"), plot);
  write_strip(run_->artifact("strip.png"), {{"photo & graph", Image(4, 4, 3, 0.5f)}, {"tracer", Image(4, 4, 3, 1.0f)}});
  run_->log("started");
  run_->finish();

  const std::string html = report();
  for (const char* part : {">study<", "vndf_caps", "albedo", "src=\"data:image/svg+xml;base64,", "error against time",
                           "<b>strip</b>", "<span>photo &amp; graph</span><span>tracer</span>", ">loss<", ">depth<",
                           ">rate<", "width = 64", "Z started", "clerestory run layer.toml", "-s1, done</p>"})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_LT(html.size(), 300000u) << "3000 records are thinned before they are drawn";
}

TEST_F(RunDirectoryReport, ResultsComeFirstAndHowItWasMadeLast) {
  Provenance provenance = begin_provenance({"/opt/clerestory", "run", "/home/me/layer.toml"});
  provenance.facts["sampler"] = "vndf_caps";
  provenance.figures["minutes"] = 3;
  write_provenance(*run_ / "provenance.json", provenance);
  MetricsWriter(run_->metrics_path()).write(1, {{"train/loss", 1}, {"train/other", 2}});
  for (const char* name : {"2_rest", "1_errors"}) {
    Table table{std::string("Table ") + name, {{"map", ""}}, {}};
    table.add({std::string("albedo")});
    std::ofstream(run_->artifact(std::string(name) + ".table.json")) << table_json(table);
  }
  std::ofstream(run_->artifact("error_time.svg")) << "<svg/>";
  write_png(run_->artifact("room_0.png"), Image(2, 2, 3, 0.5f));
  run_->log("started");
  const std::string html = report();
  std::size_t at = 0;
  for (const char* next : {">Results<", "Table 1_errors", "error time", "room 0", ">More tables<", "Table 2_rest",
                           ">Curves<", ">How it was made<", "<dt>minutes<", "vndf_caps", ">Configuration<", ">Log<"}) {
    at = html.find(next, at);
    ASSERT_NE(at, std::string::npos) << next << " is missing, or stands before what comes before it";
  }
}

TEST_F(RunDirectoryReport, NamesNoFolderOfTheComputer) {
  const std::string home = "/home/me and others";
  Provenance provenance = begin_provenance({home + "/clerestory", "train", home + "/a.toml"});
  provenance.facts["light"] = "net (" + home + "/a.toml, /srv/weights)";
  write_provenance(*run_ / "provenance.json", provenance);
  std::ofstream(*run_ / "config.resolved.toml") << "train = [\"" + home + "/rooms\"]\n";
  Table table{"Runs", {{"state", ""}}, {}, "of /srv/rooms"};
  table.add({std::string("failed: /srv/room/000")});
  std::ofstream(run_->artifact("a.table.json")) << table_json(table);
  run_->log("starts from /srv/nets/weights.safetensors (2 hours)");
  run_->fail(usage_error("/srv/rooms/000_im.exr: cannot be read"), true);
  const std::string html = report();
  for (const char* part : {"train = [&quot;rooms&quot;]", "net (a.toml, weights)", "of rooms", "failed: 000",
                           "starts from weights.safetensors (2 hours)", "000_im.exr: cannot be read"})
    EXPECT_THAT(html, HasSubstr(part));
  for (const std::string& folder : {std::string("me and others"), std::string("/srv"), root_.string()})
    EXPECT_THAT(html, Not(HasSubstr(folder)));
}

// A run that somebody sent is looked at, not run.
TEST_F(RunDirectoryReport, HostileArtifactsAreShownAndNotRun) {
  const std::string script = "<script>alert(1)</script>",
                    name = "a\"><img src=x onerror=alert(2)>" + std::string("<b>");
  Provenance provenance = begin_provenance({"clerestory", script}, script);
  provenance.facts[script] = script;
  write_provenance(*run_ / "provenance.json", provenance);
  {
    MetricsWriter metrics(run_->metrics_path());
    metrics.write(1, {{script + "loss", 1}, {"</text></svg>" + script, 2}});
    metrics.write(2, {{script + "loss", 2}, {"</text></svg>" + script, 1}});
  }
  const std::string svg =
      "<?xml version='1.0'?><svg xmlns='http://www.w3.org/2000/svg' onload='alert(3)'>" + script + "</svg>";
  std::ofstream(run_->artifact("plot.svg")) << svg;
  std::ofstream(run_->artifact(name + ".svg")) << svg;
  write_png(run_->artifact(name + ".png"), Image(2, 2, 3, 0.5f));
  Table table{script, {{script, script}}, {}};
  table.add({script});
  std::ofstream(run_->artifact("t.table.json")) << table_json(table);
  run_->log(script);
  run_->fail(usage_error(script), true);

  const std::string html = report();
  for (const char* part : {"<script>alert", "<img src=x", "onload='alert", "<b>\"", "</svg><script"})
    EXPECT_THAT(html, Not(HasSubstr(part)));
  EXPECT_THAT(html, HasSubstr("src=\"data:image/svg+xml;base64,PD94bWwgdmVyc2lvbj0n"));
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST_F(RunDirectoryReport, UnfinishedRunsHaveOneToo) {
  write_provenance(*run_ / "provenance.json", begin_provenance({"clerestory", "train"}));
  EXPECT_THAT(report(), HasSubstr("not finished"));
  run_->fail(usage_error("disk full"), true);
  EXPECT_THAT(report(), HasSubstr("disk full"));
  EXPECT_THAT(report(), Not(HasSubstr("Curves")));
}

TEST_F(RunDirectoryReport, KnowsWhatIsARun) {
  EXPECT_TRUE(is_run_directory(run_->path()));
  EXPECT_FALSE(is_run_directory(root_));
  EXPECT_THROW(report(), Error) << "no provenance.json";
}

}  // namespace
}  // namespace clerestory
