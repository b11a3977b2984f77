#include "host/report/progress.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/error.hpp"
#include "host/report/table.hpp"
#include "host/report/terminal.hpp"

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

TEST(TerminalText, ControlCharactersAreWrittenOut) {
  EXPECT_EQ(terminal_text("\x1b]0;title\x07\x1b[31mred"), "\\x1b]0;title\\x07\\x1b[31mred");
  EXPECT_EQ(terminal_text(std::string("a\0b\r\b\x7f", 6)), "a\\x00b\\x0d\\x08\\x7f");
  EXPECT_EQ(terminal_text("\xc2\x9b"
                          "31m"),
            "\\x9b31m")
      << "CSI of one character, U+009B";
  EXPECT_EQ(terminal_text("photo\xe2\x80\xaegnp.exe"), "photo\\u202egnp.exe") << "turns the direction of writing";
  EXPECT_EQ(terminal_text("line\n\tnext"), "line\n\tnext");
}

TEST(TerminalText, ReadableTextStaysAsItIs) {
  for (const std::string text : {"", "plain ~ \\x1b",
                                 "K\xc3\xbc"
                                 "che \xe5\xb1\x8b\xe5\x86\x85 \xf0\x9f\x8f\xa0 \xc2\xb1 \xc2\xa0"})
    EXPECT_EQ(terminal_text(text), text);
}

// RFC 3629: stray and missing bytes, overlong forms, a surrogate, beyond U+10FFFF.
TEST(TerminalText, BytesThatAreNoUtf8AreWrittenOut) {
  EXPECT_EQ(terminal_text("\x80"), "\\x80");
  EXPECT_EQ(terminal_text("\xc3("), "\\xc3(");
  EXPECT_EQ(terminal_text("\xe5\xb1"), "\\xe5\\xb1");
  EXPECT_EQ(terminal_text("\xc0\x9b"), "\\xc0\\x9b");
  EXPECT_EQ(terminal_text("\xe0\x80\x9b"), "\\xe0\\x80\\x9b");
  EXPECT_EQ(terminal_text("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(terminal_text("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(terminal_text("\xff\xfe"), "\\xff\\xfe");
}

TEST(TerminalText, NothingThatIsSaidOrTabulatedMovesTheCursor) {
  const std::string name = "room\x1b[2J", shown = "room\\x1b[2J";
  EXPECT_EQ(stderr_of([&] { say(name); }), shown + "\n");
  const std::string progress = stderr_of([&] { Progress(name, 1).advance(name); });
  EXPECT_EQ(progress.find('\x1b'), std::string::npos);
  EXPECT_NE(progress.find(shown), std::string::npos);
  Table table{name, {{name, name}}, {}};
  table.add({name});
  const std::string text = table_text(table);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_NE(text.find(shown), std::string::npos);
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
    for (int i = 0; i < signals; ++i) {
      kill(getpid(), SIGINT);
      while (!interrupted()) usleep(100);
      while (i == 1) usleep(100);  // until it ends us
    }
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
