// The typed form of a training config, one type a section.
#pragma once
#include <filesystem>

#include "experiments/training/batches.hpp"
#include "experiments/training/finetune_views.hpp"
#include "experiments/training/light_batches.hpp"
#include "host/io/config.hpp"
#include "nets/losses.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// When a leg of training ends: after so many steps, so many passes over the data or so many minutes, whichever comes
/// first; 0 means no such limit.
struct LegLimits {
  std::int64_t steps = 0;  // those of `epochs` included
  double minutes = 0;
  /// Part of the leg that is over, in [0, 1].
  double fraction(std::int64_t step, double minutes_so_far) const;
};

/// Learning rate as a function of the part of the leg that is over.
struct LearningRate {
  enum class Kind { Constant, Step, Cosine } kind = Kind::Cosine;
  double initial = 5e-4;
  double factor = 0.5, every = 0.25;  // Step: multiplied by `factor` after each `every` of the leg
  double least = 0.02;                // Cosine: ends at least * initial
  std::int64_t warmup = 0;            // first steps of the leg, linear from 0
  double at(std::int64_t step, double fraction) const;
};

/// A fixed list of rooms, in a folder of `clerestory generate --from-rooms`, that judges beside the validation rooms.
struct JudgingList {
  std::string name;
  std::filesystem::path folder;
  bool photographed;  // seen through a camera (photo.hpp)
};

/// Where a run goes and what it runs on.
struct RunSection {
  std::string root, experiment, variant, device, tile;
  std::uint64_t seed = 0;
};

/// What is trained, and from what it starts.
struct ModelSection {
  std::string kind;  // maps | light
  std::string preset;
  MgnetSize net;
  LightSizes light;
  Size size;            // of views; the longer side is stored with the weights
  std::string encoder;  // imagenet | random: what lite's starts from
  std::string init, gemm;
};

/// What it is trained on, and judged on.
struct DataSection {
  std::vector<std::string> train_roots, validation_roots;
  std::string train_split, validation_split;
  int validation_views = 0, mean_views = 0;
  std::vector<JudgingList> lists;
  int list_views = 0;  // judged of each list; 0: all
  std::vector<std::filesystem::path> frames;
  std::uint64_t cache_bytes = 0;
  Augmentation augmentation;
  StreamOptions stream;  // its folder is the trainer's to name
  FinetuneOptions finetune;
};

/// How.
struct TrainSection {
  int batch = 0;
  std::size_t memory = 0;  // most device memory of a step, bytes; 0: no limit
  std::string memory_key;  // with its origin, for errors
  std::int64_t steps = 0;
  double epochs = 0, minutes = 0;
  LearningRate rate;
  double encoder_rate = 1;  // factor of the rate
  double beta1 = 0, beta2 = 0;
  double runaway = 0;  // times the least mean loss that ends the leg; 0: none does
  double average = 0;  // part of the weights' moving average that a step keeps; 0: there is none
};

/// What the maps' net minimises; the light's is in LightSection::step.
struct LossSection {
  LossWeights weights;
  std::string perceptual_weights;  // file of the features; empty: they are random, or there is no such term
};

/// A light's training.
struct LightSection {
  LightTrainingOptions step;
  LightSampling sampling;
  std::string maps = "true";  // true | predicted | both
  std::string maps_weights;   // empty: the shipped ones
};

/// When a run says and keeps what it has.
struct LogSection {
  std::int64_t every = 0, validate_every = 0, checkpoint_every = 0;
  double checkpoint_minutes = 0;
};

struct TrainingOptions {
  RunSection run;
  ModelSection model;
  DataSection data;
  TrainSection train;
  LossSection loss;
  LightSection light;
  LogSection log;
};
/// Throws usage_error naming key and origin when values do not go together.
TrainingOptions training_options(const Config& config);

}  // namespace clerestory
