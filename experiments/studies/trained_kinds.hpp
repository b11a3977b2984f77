// How a study of trainings judges a kind of model, beyond what every training says of itself (its curve, its errors by
// view).
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/studies/sweep.hpp"
#include "host/io/config.hpp"

namespace clerestory {

class TrainedKind {
 public:
  virtual ~TrainedKind() = default;
  /// Its rooms need light files.
  virtual bool reads_light() const = 0;
  /// Throws usage_error where the config asks for what only another kind has.
  virtual void check(const Config& config) const = 0;
  /// Names of the tables that measure() makes.
  virtual std::vector<std::string> tables(const Config& config) const = 0;
  /// Judges a finished training's last weights on the views of `test`, by its list "test".
  virtual RunTables measure(const std::filesystem::path& run, const std::filesystem::path& test,
                            const Config& config) const = 0;
};

/// Of a value of model.kind.
const TrainedKind& trained_kind(const Config& config);

}  // namespace clerestory
