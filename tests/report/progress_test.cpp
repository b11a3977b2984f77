#include "host/report/progress.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/error.hpp"

namespace clerestory {
namespace {

/// What `work` writes to stderr, which is no terminal here.
template <class Work>
std::string stderr_of(const Work& work) {
  testing::internal::CaptureStderr();
  work();
  return testing::internal::GetCapturedStderr();
}

TEST(ProgressTest, Durations) {
  EXPECT_EQ(duration_text(0.84), "0.8 s");
  EXPECT_EQ(duration_text(9.94), "9.9 s");
  EXPECT_EQ(duration_text(9.96), "10 s");
  EXPECT_EQ(duration_text(59.4), "59 s");
  EXPECT_EQ(duration_text(59.6), "1 min 0 s");
  EXPECT_EQ(duration_text(200), "3 min 20 s");
  EXPECT_EQ(duration_text(4320), "1 h 12 min");
}

TEST(ProgressTest, PlainLinesWithoutATerminal) {
  const std::string text = stderr_of([] {
    Progress progress("views", 1000, "views");
    for (int i = 0; i < 1000; ++i) progress.advance("loss 0.5");
  });
  EXPECT_EQ(text.find('\r'), std::string::npos);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.substr(0, 11), "views: 1/10") << text;
  EXPECT_NE(text.find("views: 1000/1000 views, "), std::string::npos) << text;
  EXPECT_NE(text.find(", loss 0.5\n"), std::string::npos) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2) << "fast work: the first line and the last one\n" << text;
}

TEST(ProgressTest, EstimateOnlyWhenLong) {
  EXPECT_EQ(stderr_of([] {
              Progress progress("render", 10);
              progress.estimate(200);
              progress.estimate(300);
            }),
            "render: about 3 min 20 s\n");
  EXPECT_EQ(stderr_of([] {
              Progress progress("render", 10);
              progress.estimate(59);
            }),
            "");
}

TEST(ProgressTest, QuietIsQuiet) {
  set_quiet(true);
  const std::string text = stderr_of([] {
    Progress progress("render", 10);
    progress.estimate(1000);
    progress.update(10);
    say("a note");
  });
  set_quiet(false);
  EXPECT_EQ(text, "");
  EXPECT_EQ(stderr_of([] { say("a note"); }), "a note\n");
}

/// Exit status of a child that catches interrupts, gets `signals` of them and then asks whether to stop.
int after_interrupts(int signals) {
  const pid_t child = fork();
  if (child == 0) {
    close(STDERR_FILENO);
    catch_interrupts();
    for (int i = 0; i < signals; ++i) raise(SIGINT);
    try {
      stop_if_interrupted("runs/x");
    } catch (const Error& error) {
      _exit(error.exit_code() == 4 && std::string(error.what()).find("runs/x") != std::string::npos ? 40 : 41);
    }
    _exit(interrupted() ? 42 : 43);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

TEST(InterruptTest, FirstRaisesTheFlagSecondEnds) {
  EXPECT_EQ(after_interrupts(0), 43);
  EXPECT_EQ(after_interrupts(1), 40);
  EXPECT_EQ(after_interrupts(2), -SIGINT);
}

}  // namespace
}  // namespace clerestory
