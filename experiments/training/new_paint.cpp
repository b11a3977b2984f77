#include "experiments/training/new_paint.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <vector>

#include "experiments/training/keyed.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr std::uint64_t kDraw = 61, kLattice = 62;  // purposes
constexpr int kLeastParts = 4, kMostParts = 14;
constexpr double kAsItIs = 0.35, kReplaced = 0.12;                              // shares of parts
constexpr double kGlossy = 0.25, kRough = 0.5;                                  // roughness up to which, from which
constexpr double kLeastAlbedo = 0.02, kMostAlbedo = 0.78, kMostOfMetal = 0.92;  // as traced rooms have it
constexpr double kVeil = 0.05;     // of all light: what a rough dielectric sends back without its colour
constexpr double kMostTilt = 0.1;  // radians between the room's axes and a pattern's that goes along them

/// What tells parts of a room apart: metres, the unit normal, ln albedo, roughness.
struct Look {
  Vec3 place, normal, colour;
  double roughness = 0;
};

/// How much each difference counts.
struct LookWeights {
  double place, normal, colour, roughness;
};

double distance(const Look& a, const Look& b, const LookWeights& w) {
  const auto square = [](const Vec3& v) { return glm::dot(v, v); };
  const double rough = a.roughness - b.roughness;
  return w.place * square(a.place - b.place) + w.normal * square(a.normal - b.normal) +
         w.colour * square(a.colour - b.colour) + w.roughness * rough * rough;
}

Vec3 triple(const Image& map, int y, int x) {
  return {static_cast<double>(map.at(0, y, x)), static_cast<double>(map.at(1, y, x)),
          static_cast<double>(map.at(2, y, x))};
}

/// Number of the lattice point in [0, 1).
double lattice(const Vec3& point, std::uint64_t key) {
  const auto bits = [](double v) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(v)) & 0x1fffff; };
  return keyed_uniform(key, bits(point.x) << 42 | bits(point.y) << 21 | bits(point.z), kLattice);
}

/// Smooth noise over a lattice of unit cells, in [0, 1].
double noise(const Vec3& q, std::uint64_t key) {
  const Vec3 cell = glm::floor(q), f = q - cell, s = f * f * (3.0 - 2.0 * f);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const Vec3 w = glm::mix(1.0 - s, s, step);
    sum += w.x * w.y * w.z * lattice(cell + step, key);
  }
  return sum;
}

double clouds(const Vec3& q, std::uint64_t key) {
  return (noise(q, key) + 0.5 * noise(2.1 * q, key + 1) + 0.25 * noise(4.3 * q, key + 2)) / 1.75;
}

enum class Pattern { Stripes, Checks, Dots, Boards, Clouds, Veins };
constexpr int kPatterns = 6;

/// Mean of share_of() over space.
double mean_share(Pattern pattern) {
  constexpr double means[kPatterns] = {0.5, 0.5, 0.113, 0.5, 0.5, 0.26};  // dots: a ball of radius 0.3
  return means[static_cast<int>(pattern)];
}

/// How much of the second colour a point has, in [0, 1]; q in cells.
double share_of(Pattern pattern, const Vec3& q, std::uint64_t key) {
  const auto odd = [](double v) { return std::fmod(std::abs(v), 2.0) >= 1; };
  switch (pattern) {
    case Pattern::Stripes:
      return odd(std::floor(q.x)) ? 1 : 0;
    case Pattern::Checks: {
      const Vec3 cell = glm::floor(q);
      return odd(cell.x + cell.y + cell.z) ? 1 : 0;
    }
    case Pattern::Dots: {
      const Vec3 off = q - glm::round(q);
      return glm::dot(off, off) < 0.09 ? 1 : 0;
    }
    case Pattern::Boards:
      return lattice({std::floor(q.x), std::floor(0.2 * q.y), 0}, key);
    case Pattern::Clouds:
      return glm::smoothstep(0.3, 0.7, clouds(q, key));
    case Pattern::Veins:
      return 1 - glm::smoothstep(0.0, 0.08, std::abs(clouds(q, key) - 0.5));
  }
  return 0;
}

/// A part's new colours: `first` and `second` multiply the albedo, or take its place.
struct Paint {
  bool as_it_is = true, replaces = false;
  Vec3 first{1}, second{1};
  Pattern pattern = Pattern::Stripes;
  Mat3 frame{1};         // of the pattern's cells, from metres in camera space
  double frequency = 0;  // cells a metre
  Vec3 offset{0};        // cells
  std::uint64_t key = 0;
};

Vec3 any_colour(KeyedDraws& draws, double least, double most) {
  const double level = draws.log_between(least, most), strength = draws.unit() * draws.unit();
  return level * glm::exp(strength * draws.direction());
}

/// Rows: the directions along which cells are counted. Patterns go along the room's axes more often than not, but for a
/// tilt, without which a wall could lie on the border between two layers of cells.
Mat3 any_frame(KeyedDraws& draws, const Camera& camera) {
  const Mat3 axes = glm::transpose(camera.rotation());  // columns: the world's, in camera space
  const int first = draws.below(3);
  const Vec3 about = draws.direction();
  const double angle = draws.chance(0.6) ? draws.between(-kMostTilt, kMostTilt) : draws.between(0, std::numbers::pi);
  const Mat3 turn(glm::rotate(Mat4(1), angle, about));
  return glm::transpose(turn * Mat3(axes[first], axes[(first + 1) % 3], axes[(first + 2) % 3]));
}

Paint any_paint(KeyedDraws& draws, const Camera& camera, std::uint64_t key) {
  Paint paint;
  const double kind = draws.unit();
  paint.as_it_is = kind < kAsItIs;
  paint.replaces = kind > 1 - kReplaced;
  const double least = paint.replaces ? 0.03 : 0.25, most = paint.replaces ? 0.9 : 2.5;
  paint.first = paint.second = any_colour(draws, least, most);
  if (draws.chance(0.5)) paint.second = any_colour(draws, least, most);
  paint.pattern = static_cast<Pattern>(draws.below(kPatterns));
  paint.frame = any_frame(draws, camera);
  paint.frequency = draws.log_between(1, 25);
  paint.offset = Vec3{draws.unit(), draws.unit(), draws.unit()};
  paint.key = keyed_bits(key, 0, kLattice);
  return paint;
}

/// What the albedo of a point becomes; `footprint`: metres of a pixel there.
Vec3 painted(const Paint& paint, const Vec3& albedo, const Vec3& place, double footprint, double most) {
  // What is finer than pixels can show fades into its mean.
  const double shown = glm::clamp(2 - 4 * footprint * paint.frequency, 0.0, 1.0), mean = mean_share(paint.pattern);
  const Vec3 q = paint.frequency * (paint.frame * place) + paint.offset;
  const double second = shown > 0 ? glm::mix(mean, share_of(paint.pattern, q, paint.key), shown) : mean;
  const Vec3 colour = glm::mix(paint.first, paint.second, second);
  const Vec3 wanted = paint.replaces ? colour : colour * albedo;
  return glm::clamp(wanted, glm::min(albedo, Vec3(kLeastAlbedo)), glm::max(albedo, Vec3(most)));
}

/// How much of the paint a pixel takes: highlights have no albedo.
double paintable(const PreparedView& view, int y, int x) {
  if (view.masks.albedo.at(0, y, x) == 0 || view.masks.material.at(0, y, x) == 0) return 0;
  if (view.truth.material.at(1, y, x) > 0.5f) return 1;
  return glm::smoothstep(kGlossy, kRough, static_cast<double>(view.truth.material.at(0, y, x)));
}

class Painter {
 public:
  Painter(PreparedView& view, std::uint64_t key) : view_(view), camera_(*view.camera), draws_(key, kDraw), key_(key) {
    for (int y = 0; y < view.image.height; ++y)
      for (int x = 0; x < view.image.width; ++x)
        if (view.masks.geometry.at(0, y, x) > 0) known_.push_back({x, y});
  }

  void work() {
    if (known_.empty()) return;
    choose_parts();
    for (const auto& [x, y] : known_)
      if (const double share = paintable(view_, y, x); share > 0) paint_pixel(x, y, share);
    scale(view_.image.data, exposure_of(view_.image.data));
  }

 private:
  struct Pixel {
    int x, y;
  };
  struct Part {
    Look look;
    Paint paint;
  };

  Look look_of(int x, int y) const {
    const double metres = static_cast<double>(view_.truth.depth.at(0, y, x)) * view_.scene_scale;
    const Vec3 colour = glm::log(glm::max(triple(view_.truth.albedo, y, x), Vec3(kLeastAlbedo)));
    return {camera_.unproject(x + 0.5, y + 0.5, metres), triple(view_.truth.normal, y, x), colour,
            static_cast<double>(view_.truth.material.at(0, y, x))};
  }

  void choose_parts() {
    weights_ = {draws_.log_between(0.2, 3), draws_.between(0.5, 3), draws_.between(0, 1), draws_.between(0, 4)};
    const int count = kLeastParts + draws_.below(kMostParts - kLeastParts + 1);
    for (int i = 0; i < count; ++i) {
      const Pixel& seed = known_[static_cast<std::size_t>(draws_.below(static_cast<int>(known_.size())))];
      parts_.push_back({look_of(seed.x, seed.y), any_paint(draws_, camera_, keyed_mix(key_) + i)});
    }
  }

  void paint_pixel(int x, int y, double share) {
    const Look look = look_of(x, y);
    const auto nearer = [&](const Part& a, const Part& b) {
      return distance(look, a.look, weights_) < distance(look, b.look, weights_);
    };
    const Paint& paint = std::min_element(parts_.begin(), parts_.end(), nearer)->paint;
    if (paint.as_it_is) return;
    const double metallic = static_cast<double>(view_.truth.material.at(1, y, x));
    const double most = glm::mix(kMostAlbedo, kMostOfMetal, metallic), veil = kVeil * (1 - metallic);
    const Vec3 before = triple(view_.truth.albedo, y, x);
    const Vec3 after = glm::mix(before, painted(paint, before, look.place, footprint(look), most), share);
    for (int c = 0; c < 3; ++c) {
      view_.image.at(c, y, x) *= static_cast<float>((after[c] + veil) / std::max(before[c] + veil, 1e-3));
      view_.truth.albedo.at(c, y, x) = static_cast<float>(after[c]);
    }
  }

  /// Metres of a pixel along the surface, where that is longest.
  double footprint(const Look& look) const {
    const double facing = std::abs(glm::dot(look.normal, glm::normalize(look.place)));
    return -look.place.z / camera_.fx / std::max(0.1, facing);
  }

  PreparedView& view_;
  const Camera camera_;
  KeyedDraws draws_;
  std::uint64_t key_;
  std::vector<Pixel> known_;
  LookWeights weights_{};
  std::vector<Part> parts_;
};

}  // namespace

void paint_anew(PreparedView& view, std::uint64_t key) {
  if (view.camera) Painter(view, key).work();
}

}  // namespace clerestory
