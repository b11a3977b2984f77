// MGNet on pictures at the size that it has learned with: what training, evaluation and `invert` take its maps from.
#pragma once
#include <memory>
#include <vector>

#include "experiments/evaluation/metrics.hpp"
#include "host/graph/plan.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// Which maps somebody asks for: the decoders of others are pruned from the plan.
struct WantedMaps {
  bool albedo = true, normal = true, depth = true, material = true;
  bool any() const { return albedo || normal || depth || material; }
};

/// What a plan gives out for these.
std::vector<Value> wanted_outputs(const Maps& maps, const WantedMaps& wanted);

/// What MGNet says about one picture.
struct MapPrediction {
  MapSet maps;           // at the size of the picture that was given; empty where not wanted
  double log_scale = 0;  // with depth
};

/// What a judgement of predictions says of them.
inline constexpr const char* kPredictionConvention =
    "predictions: the mean of what the net says of the picture and, mirrored back, of its mirror image";

/// Mean of both, normals of length 1. What is empty in one is so in the other.
MapPrediction mean_of(MapPrediction one, const MapPrediction& other);
/// As a mirror shows it: left and right exchanged, the normals' x of the other sign.
MapPrediction mirrored(MapPrediction prediction);

/// Runs MGNet with the states given (running statistics, no update). Each picture is looked at twice, as it is and
/// mirrored, and the maps are the mean of both: a room mirrored is as likely a room, so what the net says of one alone
/// is its own error.
class MapPredictor {
 public:
  /// `batch`: pictures at once.
  MapPredictor(Device device, const MgnetSize& net, std::shared_ptr<States> states, int batch,
               const WantedMaps& wanted = {}, Precision precision = Precision::Single);
  ~MapPredictor();

  /// Pictures of one size, exposed but neither clamped nor padded (prepare.hpp).
  std::vector<MapPrediction> predict(const std::vector<const Image*>& pictures);
  /// The plan for pictures of this size.
  std::string explain(int width, int height);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clerestory
