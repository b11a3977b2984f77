// Views with light of rooms that are made while training goes on.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "experiments/training/light_views.hpp"
#include "experiments/training/recent.hpp"
#include "experiments/training/room_stream.hpp"

namespace clerestory {

struct NamedLightView {
  std::string name;
  std::shared_ptr<const LightView> view;
};

/// Which view stands at a position is a function of (seed, position), as RoomStream says.
class StreamedLight {
 public:
  using Predict = std::function<MapSet(const Image& picture)>;
  /// `predict`: MGNet's maps of a picture; may be empty where nobody asks for them. `first`: the first position.
  StreamedLight(const StreamOptions& options, Size size, std::uint64_t seed, std::uint64_t first, Predict predict);

  /// Positions do not fall. With `predicted` the view's maps are what MGNet says of its picture, its depth brought to
  /// true metres (metres_of). Throws what read_light_view throws.
  NamedLightView at(std::uint64_t position, bool predicted);

 private:
  struct Kept {
    std::shared_ptr<const LightView> true_maps, predicted;  // the latter once it was asked for
  };

  Size size_;
  Predict predict_;
  RoomStream rooms_;
  Recent<Kept> recent_;
};

}  // namespace clerestory
