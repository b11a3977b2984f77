// One training step of MGNet as a graph: maps, losses, gradients, Adam, running statistics.
#pragma once
#include "host/ops/nn/adam.hpp"
#include "nets/losses.hpp"

namespace clerestory {

struct MgnetTrainingOptions {
  int batch = 8, height = 128, width = 160;  // as fed; sizes of 16 and above work, multiples of 32 need no resizing
  LossWeights weights{};
  AdamOptions adam{.beta1 = 0.5};
  double average = 0;       // part of the moving average of parameters that a step keeps; 0: there is none
  int judgements = 0;       // of a picture's pixels, at most; 0: none are fed
  double encoder_rate = 1;  // factor of the learning rate for the encoder
};

/// The inputs are named "image" {n,3,h,w}, "albedo" {n,3,h,w}, "normal" {n,3,h,w}, "material" {n,2,h,w}, "depth"
/// {n,1,h,w}, "albedo_mask", "geometry_mask", "material_mask" {n,1,h,w}, "log_scale", "scale_mask" {n,1,1,1},
/// "learning_rate" and "step" {1,1,1,1} (1 for the first), with judgements those of JudgedAlbedo, "judged_first",
/// "judged_second" Int, "judged_equal" and "judged_ordered" {1,1,n,judgements}. Compile with updates = true; states
/// beside the parameters are moments "adam.m.<name>", "adam.v.<name>", averages "average.<name>" and running
/// statistics. With weights.perceptual > 0 there are also those of weights.features, which the caller sets from a file
/// but where they are Random.
struct MgnetTraining {
  Maps maps;
  NamedValues losses;               // "loss" first
  std::vector<std::string> frozen;  // scopes that no term of a weight above zero sees: none of their parameters moves
  std::vector<Value> parameters;    // that are trained
  Value squares;                    // of their gradients and of them before the step, in their order: adam()
};
MgnetTraining mgnet_training(Graph& graph, const MgnetSize& size, const MgnetTrainingOptions& options);

}  // namespace clerestory
