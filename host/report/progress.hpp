// Progress of long work on stderr, and a Ctrl-C that lets it end properly.
#pragma once
#include <cstdint>
#include <string>

namespace clerestory {

/// Process-wide: no progress, no notes (--quiet). Errors still speak.
void set_quiet(bool quiet);
bool quiet();

/// One line for people on stderr, with a newline; silent when quiet. A drawn progress bar is cleared first.
void say(const std::string& line);

/// A bar on a terminal, redrawn at most ten times a second; elsewhere a plain line at every tenth, or every half minute
/// if that is rarer. The estimate of the whole is printed once, as soon as it is known and if it is over a minute.
class Progress {
 public:
  /// `unit` names one step ("steps", "views"). `already`: steps done by an earlier, interrupted run; they do not count
  /// for speed.
  Progress(std::string label, std::int64_t total, std::string unit = "steps", std::int64_t already = 0);
  ~Progress();  // finishes the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Prints the estimate before the work starts, where the caller knows one (a measured first step).
  void estimate(double seconds);
  /// `note` stands at the end of the bar ("loss 0.041").
  void update(std::int64_t done, const std::string& note = {});
  void advance(const std::string& note = {}) { update(done_ + 1, note); }

 private:
  void draw(double now);
  std::string line(double now) const;
  std::string label_, unit_, note_;
  std::int64_t total_, already_, done_;
  double start_, last_drawn_ = -1e9;
  int last_tenth_ = -1;
  bool terminal_, drawn_ = false, estimated_ = false;
};

/// "1 h 12 min", "3 min 20 s", "45 s", "0.8 s".
std::string duration_text(double seconds);

/// From here on the first Ctrl-C (or SIGTERM) only raises a flag, the second ends the program at once. Call it before
/// threads are started (a device has some): signals that reach an older thread end the program.
void catch_interrupts();
bool interrupted();
/// Throws ErrorKind::Interrupted once the flag is up. Call where stopping is safe: after a checkpoint, between views.
/// `where` says what can be resumed.
void stop_if_interrupted(const std::string& where);
/// The same for work that leaves nothing half done: the same command begins again.
void give_up_if_interrupted(const std::string& where);

}  // namespace clerestory
