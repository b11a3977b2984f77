#include "experiments/applications/samples_record.hpp"

#include "host/report/progress.hpp"

namespace clerestory {
namespace {

/// What was reached, and where that is less than what was asked for.
std::string error_text(const RenderGoal& goal, const std::vector<RenderRound>& rounds) {
  const RenderRound& last = rounds.back();
  std::string text = fmt::format("root relMSE {:.4f} after {} samples a pixel in {} rounds, {:.1f} s", last.error,
                                 last.spp, rounds.size(), last.seconds);
  if (goal.error > 0)
    text += fmt::format(" (asked: {:g}{})", goal.error, last.error <= goal.error ? "" : "; it ended before");
  return text;
}

}  // namespace

void record_samples(const RenderSettings& settings, Provenance& record) {
  record.facts["samples"] = fmt::format("{} a pixel, {}, {}", settings.spp, settings.sampler, settings.points);
}

void record_rounds(const RenderGoal& goal, const std::vector<RenderRound>& rounds, const std::string& of,
                   const std::string& command, Provenance& record) {
  const RenderRound& last = rounds.back();
  record.figures["samples a pixel"] = last.spp;
  record.figures["root relMSE, measured"] = last.error;
  record.figures["seconds: rounds of samples"] = last.seconds;
  std::string& text = record.facts["error of " + of];
  text = error_text(goal, rounds);
  say(command + ": " + text);
}

}  // namespace clerestory
