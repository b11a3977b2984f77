#include "tracer/layout.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace clerestory {
namespace {

constexpr float kQuarter = std::numbers::pi_v<float> / 2;

bool blocks(const Wall& wall, float x, const Piece& piece) {
  const float x0 = x - piece.size.x / 2, x1 = x + piece.size.x / 2;
  for (const Opening& o : wall.openings) {
    if (x1 > o.x0 && x0 < o.x1 && (o.kind != Opening::Window || piece.size.y > o.y0)) return true;
  }
  return std::any_of(wall.taken.begin(), wall.taken.end(),
                     [&](const Wall::Taken& t) { return x1 > t.x0 && x0 < t.x1; });
}

bool holds(const Floor& f, const Occupied& o) {
  return o.x0 >= f.x0 && o.x1 <= f.x1 && o.z0 >= f.z0 && o.z1 <= f.z1 && o.height <= f.height;
}

}  // namespace

Layout::Layout(Room& room, std::vector<Wall>& walls, Shapes& shapes, Random random)
    : room_(room), walls_(walls), shapes_(shapes), random_(random) {
  for (const Wall& wall : walls_)
    for (const Opening& o : wall.openings) {
      if (o.kind == Opening::Window) continue;
      reserve(wall.to_room, o, o.kind == Opening::Niche ? 0.3f : 0.85f);
    }
}

bool Layout::against_wall(const Piece& piece, bool centred, float gap) {
  for (int attempt = 0; attempt < 16; ++attempt) {
    Wall& wall = walls_[static_cast<std::size_t>(random_.whole(0, static_cast<int>(walls_.size()) - 1))];
    const float slack = wall.length / 2 - piece.size.x / 2 - 0.03f;
    if (slack < 0 || !wall.takes_furniture()) continue;
    const float x = centred && attempt < 8 ? random_.between(-0.2f, 0.2f) * slack : random_.between(-slack, slack);
    if (!wall.is_free(x - piece.size.x / 2, x + piece.size.x / 2, 0.02f) && blocks(wall, x, piece)) continue;
    const glm::mat4 pose = glm::translate(wall.to_room, {x, 0, piece.size.z / 2 + gap});
    if (!place(piece, pose)) continue;
    wall.taken.push_back({x - piece.size.x / 2, x + piece.size.x / 2, piece.size.y});
    last_ = pose;
    return true;
  }
  return false;
}

bool Layout::in_the_open(const Piece& piece, float spread, bool turn_freely) {
  for (int attempt = 0; attempt < 16; ++attempt) {
    const float x = random_.between(-0.5f, 0.5f) * spread * room_.size.x,
                z = random_.between(-0.5f, 0.5f) * spread * room_.size.z;
    const float turn = turn_freely
                           ? random_.between(0, 4 * kQuarter)
                           : kQuarter * static_cast<float>(random_.whole(0, 3)) + random_.between(-0.08f, 0.08f);
    const glm::mat4 pose = glm::rotate(glm::translate(glm::mat4(1), {x, 0, z}), turn, {0, 1, 0});
    if (place(piece, pose)) {
      last_ = pose;
      return true;
    }
  }
  return false;
}

bool Layout::before_last(const Piece& piece, float distance, bool facing) {
  glm::mat4 pose = glm::translate(last_, {0, 0, distance});
  if (facing) pose = glm::rotate(pose, 2 * kQuarter, {0, 1, 0});
  return place(piece, pose);
}

bool Layout::beside_last(const Piece& piece, float distance, float back) {
  const float side = random_.one_of({-1.f, 1.f});
  for (const float s : {side, -side}) {
    const glm::mat4 pose = glm::translate(last_, {s * distance, 0, back});
    if (place(piece, pose)) return true;
  }
  return false;
}

Occupied Layout::footprint(const glm::mat4& pose, const glm::vec3& size) const {
  Occupied o{1e9f, 1e9f, -1e9f, -1e9f, size.y, {}};
  for (const float x : {-0.5f, 0.5f}) {
    for (const float z : {-0.5f, 0.5f}) {
      const glm::vec4 p = pose * glm::vec4(x * size.x, 0, z * size.z, 1);
      o.x0 = std::min(o.x0, p.x), o.x1 = std::max(o.x1, p.x);
      o.z0 = std::min(o.z0, p.z), o.z1 = std::max(o.z1, p.z);
    }
  }
  return o;
}

/// The way through an opening: `depth` into the room, and of a passage its whole floor.
void Layout::reserve(const glm::mat4& wall, const Opening& o, float depth) {
  const float back = o.kind == Opening::Passage ? -o.depth : 0;
  // Into a bay one walks anywhere: only a strip at its mouth stays free.
  const float share = o.kind == Opening::Bay ? 0.35f : 1.f, half = (o.x1 - o.x0) / 2 * share;
  const glm::mat4 pose = glm::translate(wall, {(o.x0 + o.x1) / 2, 0, (back + depth) / 2});
  ways_.push_back(footprint(pose, {2 * half, 0, depth - back}));
}

bool Layout::is_free(const Occupied& o) const {
  constexpr float apart = 0.03f;
  const auto meets = [&](const Occupied& other) {
    return o.x1 > other.x0 - apart && o.x0 < other.x1 + apart && o.z1 > other.z0 - apart && o.z0 < other.z1 + apart;
  };
  return std::none_of(room_.occupied.begin(), room_.occupied.end(), meets) &&
         std::none_of(ways_.begin(), ways_.end(), meets);
}

bool Layout::place(const Piece& piece, const glm::mat4& pose) {
  Occupied o = footprint(pose, piece.size);
  o.name = piece.name;
  const auto in = [&](const Floor& f) { return holds(f, o); };
  if (std::none_of(room_.floors.begin(), room_.floors.end(), in) || !is_free(o)) return false;
  room_.occupied.push_back(o);
  Shapes at = shapes_.at(pose);
  piece.build(at);
  return true;
}

}  // namespace clerestory
