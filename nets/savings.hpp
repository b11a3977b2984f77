// What a re-render may leave out where a scene does not need it. Which are in effect follows from the scene's traits
// (nets/scene_traits.hpp).
#pragma once
#include <array>
#include <set>
#include <string>

namespace clerestory {

enum class Saving { SharedAnswers, SmallShares, Lobes, Tracing };

/// One line of the table.
struct SavingKind {
  Saving saving;
  const char* name;   // "small shares"
  const char* what;   // that is left out
  const char* error;  // that this makes
  bool exact;         // none: the same bits of radiance
};
inline constexpr std::array kSavings{
    SavingKind{Saving::SharedAnswers, "shared answers", "the in-view MLP once for each ray",
               "root relMSE of the picture 0.001 to 0.0045, below 0.02 where half of it is mirrors", false},
    SavingKind{Saving::SmallShares, "small shares", "a part of the light where its share of a ray is at most 0.001",
               "at most 0.001 of that part", false},
    SavingKind{Saving::Lobes, "lobes", "how lobes see rays, which lamps alone ask", "same bits", true},
    SavingKind{Saving::Tracing, "tracing", "screen-space rays", "same bits; no u is known", true}};

inline const SavingKind& kind_of(Saving saving) { return kSavings[static_cast<std::size_t>(saving)]; }

inline std::set<Saving> all_savings() {
  std::set<Saving> all;
  for (const SavingKind& kind : kSavings) all.insert(kind.saving);
  return all;
}

}  // namespace clerestory
