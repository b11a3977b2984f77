// Progress on stderr and the two-stage Ctrl-C.
#include "host/report/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <thread>

#include "host/error.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

std::atomic<bool> g_quiet{false};
std::atomic<bool> g_interrupted{false};
std::mutex g_terminal;     // lines of several threads do not mix
bool g_bar_shown = false;  // a bar without newline stands on the terminal; guarded by g_terminal

int terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
}

void print_line(const std::string& line) {
  const std::lock_guard guard(g_terminal);
  std::fprintf(stderr, "%s%s\n", g_bar_shown ? "\r\x1b[K" : "", terminal_text(line).c_str());
  g_bar_shown = false;
}

void print_bar(const std::string& line) {
  const std::lock_guard guard(g_terminal);
  std::fprintf(stderr, "\r\x1b[K%s", line.c_str());
  std::fflush(stderr);
  g_bar_shown = true;
}

/// Ctrl-C, a request to end, and a closed terminal, unless whoever started this (nohup) had that ignored.
sigset_t interrupts() {
  sigset_t set;
  sigemptyset(&set), sigaddset(&set, SIGINT), sigaddset(&set, SIGTERM);
  struct sigaction hangup {};
  if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);
  return set;
}

/// A thread of its own waits for signals that all others block.
void wait_for_interrupts() {
  const sigset_t set = interrupts();
  for (int signal = 0; sigwait(&set, &signal) == 0;) {
    if (g_interrupted.exchange(true)) {
      std::signal(signal, SIG_DFL);
      pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
      std::raise(signal);
    }
    say("\nstopping as soon as nothing is lost; once more to stop at once");
  }
}

/// Cut at a character, not inside one.
std::string first_columns(const std::string& text, int columns) {
  int seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i)
    if ((text[i] & 0xc0) != 0x80 && ++seen > columns) return text.substr(0, i);
  return text;
}

}  // namespace

void set_quiet(bool quiet) { g_quiet = quiet; }
bool quiet() { return g_quiet; }

void say(const std::string& line) {
  if (!g_quiet) print_line(line);
}

std::string duration_text(double seconds) {
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<std::int64_t>(std::llround(seconds));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

Progress::Progress(std::string label, std::int64_t total, std::string unit, std::int64_t already)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(total),
      already_(already),
      done_(already),
      start_(clock_seconds()),
      terminal_(::isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (drawn_ && !g_quiet) print_line(line(clock_seconds()));
}

void Progress::estimate(double seconds) {
  if (estimated_) return;
  estimated_ = true;
  if (seconds > 60) say(fmt::format("{}: about {}", label_, duration_text(seconds)));
}

void Progress::update(std::int64_t done, const std::string& note) {
  done_ = done;
  note_ = note;
  const double now = clock_seconds(), spent = now - start_;
  // Two seconds of work are the first estimate worth printing.
  if (!estimated_ && spent > 2 && done_ > already_)
    estimate(spent * static_cast<double>(total_ - already_) / static_cast<double>(done_ - already_));
  draw(now);
}

std::string Progress::line(double now) const {
  const double spent = now - start_;
  const auto made = static_cast<double>(done_ - already_);
  std::string text = fmt::format("{}/{} {}", done_, total_, unit_);
  if (done_ >= total_)
    text += ", " + duration_text(spent);
  else if (made > 0)
    text += ", " + duration_text(spent * static_cast<double>(total_ - done_) / made) + " left";
  return label_ + ": " + text + (note_.empty() ? "" : ", " + note_);
}

void Progress::draw(double now) {
  if (g_quiet) return;
  const double share =
      total_ > 0 ? std::clamp(static_cast<double>(done_) / static_cast<double>(total_), 0.0, 1.0) : 1.0;
  if (terminal_) {
    if (now - last_drawn_ < 0.1) return;
    constexpr int kWidth = 20;
    const int full = static_cast<int>(share * kWidth);
    std::string bar;
    for (int i = 0; i < kWidth; ++i) bar += i < full ? "\u2501" : "\u2500";
    const std::string text = terminal_text(fmt::format("{} {:3.0f} % {}", bar, share * 100, line(now)));
    print_bar(first_columns(text, terminal_columns() - 1));
    drawn_ = true;
  } else {
    const int tenth = static_cast<int>(share * 10);
    if (tenth <= last_tenth_ || (now - last_drawn_ < 30 && done_ < total_)) return;
    last_tenth_ = tenth;
    print_line(line(now));
  }
  last_drawn_ = now;
}

void catch_interrupts() {
  static const bool once = [] {
    // Blocked, not handled: LLVM, which builds kernels in this process, puts a handler of its own over any other, and
    // on a signal it deletes the files of a build that is under way, which then fails. Threads and programs that are
    // started from here on inherit the block: a Ctrl-C in a terminal does not end a linker or gnuplot in its work.
    const sigset_t set = interrupts();
    pthread_sigmask(SIG_BLOCK, &set, nullptr);
    std::signal(SIGPIPE, SIG_IGN);  // who reads what is said may leave; work goes on
    std::thread(wait_for_interrupts).detach();
    return true;
  }();
  static_cast<void>(once);
}

bool interrupted() { return g_interrupted; }

void stop_if_interrupted(const std::string& where) {
  if (interrupted()) throw Error(ErrorKind::Interrupted, "interrupted, the same command goes on from here", where);
}

void give_up_if_interrupted(const std::string& where) {
  if (interrupted()) throw Error(ErrorKind::Interrupted, "interrupted, nothing was written", where);
}

}  // namespace clerestory
