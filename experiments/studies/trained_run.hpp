// What studies read of a finished training, whatever it trained.
#pragma once
#include "experiments/weights/history.hpp"

namespace clerestory {

/// In a run's folder. "best" would have been chosen on the views that judge.
inline constexpr const char* kLastWeights = "artifacts/last.safetensors";

/// Errors by view that a study has measured beside those of the training itself (artifacts/views.json).
inline constexpr const char* kMeasuredErrors = "artifacts/measured.json";

/// Seconds of a step as a leg's time counts: the device's, judging and others' work left out. NaN without a step.
double step_seconds(const Leg& leg);

}  // namespace clerestory
