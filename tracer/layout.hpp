// Where furniture goes: keeps pieces apart, doors free and windows unblocked.
#pragma once
#include <vector>

#include "tracer/room_shell.hpp"

namespace clerestory {

class Layout {
 public:
  Layout(Room& room, std::vector<Wall>& walls, Shapes& shapes, Random random);

  /// With its back to a wall; at a random stretch that is free. `centred`: in the middle of the wall if possible.
  bool against_wall(const Piece& piece, bool centred = false, float gap = 0.02f);
  /// Away from the walls, turned by quarters and a little.
  bool in_the_open(const Piece& piece, float spread, bool turn_freely = false);
  /// In front of what was placed last, at `distance` from its middle, facing it when `facing`.
  bool before_last(const Piece& piece, float distance, bool facing);
  /// Beside what was placed last, at `distance` to its right or left.
  bool beside_last(const Piece& piece, float distance, float back);

  /// Pose of what was placed last.
  const glm::mat4& last() const { return last_; }

 private:
  Occupied footprint(const glm::mat4& pose, const glm::vec3& size) const;
  void reserve(const glm::mat4& wall, const Opening& opening, float depth);
  bool is_free(const Occupied& o) const;
  bool place(const Piece& piece, const glm::mat4& pose);

  Room& room_;
  std::vector<Wall>& walls_;
  Shapes& shapes_;
  Random random_;
  glm::mat4 last_{1};
  std::vector<Occupied> ways_;  // in front of doors, and into recesses
};

}  // namespace clerestory
