// What studies read of a finished training, whatever it trained.
#pragma once
#include <filesystem>

namespace clerestory {

/// In a run's folder. "best" would have been chosen on the views that judge.
inline constexpr const char* kLastWeights = "artifacts/last.safetensors";

/// Errors by view that a study has measured beside those of the training itself (artifacts/views.json).
inline constexpr const char* kMeasuredErrors = "artifacts/measured.json";

/// Median seconds of a step of so many views; NaN where the training logged none.
double median_step_seconds(const std::filesystem::path& run, int batch);

}  // namespace clerestory
