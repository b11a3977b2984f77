// `clerestory generate --manifest`: a data set with a name, made and judged.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "experiments/commands/cli.hpp"
#include "tracer/generate.hpp"

namespace clerestory {

/// What the command line says beside a manifest.
struct SetWish {
  std::filesystem::path manifest, out, assets;
  std::optional<int> rooms;  // of each split the first; all by default
  int shard = 0, shards = 1;
  bool write_expected = false, mitsuba = false;
};

/// Throws usage_error naming the first option on the command line that has no say beside --manifest.
void refuse_fixed(const CommonOptions& common);

/// Makes the rooms of all splits, then their views. Throws usage_error before anything is traced where assets or rooms
/// are others than those of the manifest, and Error (Failed) at the end where pixels are. With `write_expected`: makes
/// the first rooms only, and writes what must come out into the manifest.
GenerateSummary make_set(const std::string& device, const SetWish& wish);

}  // namespace clerestory
