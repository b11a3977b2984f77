#include "tracer/sky.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include "host/math/panorama.hpp"
#include "tracer/random.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 256, kHeight = 128;
constexpr float kPi = std::numbers::pi_v<float>;
/// Radius of the sun's disc: the true one, 0.27 degrees, would be a fraction of a pixel.
constexpr float kSunRadius = 2.4f * kPi / 180;
/// The sun's irradiance over that of the clear sky on level ground. Four is true; less is what few samples resolve.
constexpr float kSunShare = 0.8f;
/// The same of sunny skies, and the radius of their disc: two or three pixels, for patches with borders.
constexpr float kSunnyShare = 3.2f, kSunnyRadius = 1.6f * kPi / 180;
constexpr std::string_view kPrefix = "sky-", kSunnyPrefix = "sun-";

glm::vec3 rgb_of_xyz(const glm::vec3& c) {
  return {3.2406f * c.x - 1.5372f * c.y - 0.4986f * c.z, -0.9689f * c.x + 1.8758f * c.y + 0.0415f * c.z,
          0.0557f * c.x - 0.2040f * c.y + 1.0570f * c.z};
}

/// The five coefficients of Perez for one quantity, linear in turbidity.
struct Perez {
  float a, b, c, d, e;
  Perez(float t, const std::array<float, 10>& k)
      : a(k[0] * t + k[1]), b(k[2] * t + k[3]), c(k[4] * t + k[5]), d(k[6] * t + k[7]), e(k[8] * t + k[9]) {}
  /// At a cosine from the zenith and an angle from the sun.
  float operator()(float cosine, float angle) const {
    const float near_sun = std::cos(angle);
    return (1 + a * std::exp(b / std::max(cosine, 0.01f))) * (1 + c * std::exp(d * angle) + e * near_sun * near_sun);
  }
};

/// Preetham et al. 1999, appendices A.2: luminance and chromaticity over the sky.
class ClearSky {
 public:
  ClearSky(float turbidity, const glm::vec3& sun)
      : sun_(sun),
        luminance_(turbidity,
                   {0.1787f, -1.4630f, -0.3554f, 0.4275f, -0.0227f, 5.3251f, 0.1206f, -2.5771f, -0.0670f, 0.3703f}),
        x_(turbidity,
           {-0.0193f, -0.2592f, -0.0665f, 0.0008f, -0.0004f, 0.2125f, -0.0641f, -0.8989f, -0.0033f, 0.0452f}),
        y_(turbidity,
           {-0.0167f, -0.2608f, -0.0950f, 0.0092f, -0.0079f, 0.2102f, -0.0441f, -1.6537f, -0.0109f, 0.0529f}) {
    const float t = turbidity, s = std::acos(sun.y);
    const auto cubic = [s](float c3, float c2, float c1, float c0) { return ((c3 * s + c2) * s + c1) * s + c0; };
    zenith_x_ = t * t * cubic(0.00166f, -0.00375f, 0.00209f, 0) + t * cubic(-0.02903f, 0.06377f, -0.03202f, 0.00394f) +
                cubic(0.11693f, -0.21196f, 0.06052f, 0.25886f);
    zenith_y_ = t * t * cubic(0.00275f, -0.00610f, 0.00317f, 0) + t * cubic(-0.04214f, 0.08970f, -0.04153f, 0.00516f) +
                cubic(0.15346f, -0.26756f, 0.06670f, 0.26688f);
    at_zenith_ = {luminance_(1, s), x_(1, s), y_(1, s)};
  }

  /// In units of the zenith's luminance.
  glm::vec3 operator()(const glm::vec3& d) const {
    const float angle = std::acos(std::clamp(glm::dot(d, sun_), -1.f, 1.f));
    const float l = luminance_(d.y, angle) / at_zenith_.x, x = zenith_x_ * x_(d.y, angle) / at_zenith_.y,
                y = zenith_y_ * y_(d.y, angle) / at_zenith_.z;
    return glm::max(rgb_of_xyz(glm::vec3(x / y, 1, (1 - x - y) / y) * l), glm::vec3(0));
  }

 private:
  glm::vec3 sun_;
  Perez luminance_, x_, y_;
  float zenith_x_ = 0, zenith_y_ = 0;
  glm::vec3 at_zenith_{1};
};

/// What the air leaves of sunlight at three wavelengths (Preetham et al. 1999, appendix A.1: Rayleigh and aerosol).
glm::vec3 through_air(float turbidity, float height) {
  const float degrees_down = 90 - height * 180 / kPi;
  const float mass = 1 / (std::sin(height) + 0.15f * std::pow(93.885f - degrees_down, -1.253f));
  const float beta = 0.04608f * turbidity - 0.04586f;
  glm::vec3 left;
  for (int c = 0; c < 3; ++c) {
    const float micrometres = c == 0 ? 0.61f : c == 1 ? 0.55f : 0.465f;
    left[c] = std::exp(
        -mass * (0.008735f * std::pow(micrometres, -4.08f) + std::max(beta, 0.f) * std::pow(micrometres, -1.3f)));
  }
  return left;
}

/// Value noise in the plane, in [0, 1].
float noise(float x, float y, std::uint64_t key) {
  const float fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
  const float sx = tx * tx * (3 - 2 * tx), sy = ty * ty * (3 - 2 * ty);
  const auto value = [&](float dx, float dy) {
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx + dx)),
               row = static_cast<std::uint64_t>(static_cast<std::int64_t>(fy + dy));
    const std::uint64_t cell = column * 0x9e3779b97f4a7c15u ^ row * 0xc2b2ae3d27d4eb4fu;
    return static_cast<float>(Random::mix(key ^ Random::mix(cell)) >> 40) * 0x1p-24f;
  };
  const float low = value(0, 0) + (value(1, 0) - value(0, 0)) * sx,
              high = value(0, 1) + (value(1, 1) - value(0, 1)) * sx;
  return low + (high - low) * sy;
}

float fractal(float x, float y, std::uint64_t key) {
  return (4 * noise(x, y, key) + 2 * noise(2 * x, 2 * y, key + 1) + noise(4 * x, 4 * y, key + 2)) / 7;
}

/// One thing before the sky: a block of a house with windows, or a crown of leaves.
struct Standing {
  bool tree = false;
  float middle = 0, half = 0, top = 0,
        foot = 0;  // radians; top and foot: height above the horizon
  glm::vec3 color{0};
  float floors = 0, columns = 0;
  std::uint64_t key = 0;
};

class View {
 public:
  explicit View(Random r, bool sunny = false)
      : sun_share_(sunny ? kSunnyShare : kSunShare), sun_radius_(sunny ? kSunnyRadius : kSunRadius) {
    const float cloudy = r.unit();
    cloud_ = sunny ? 0.f : cloudy < 0.4f ? 0.f : cloudy < 0.75f ? 1.f : r.unit();
    turbidity_ = r.between(2, 8);
    const float height = std::asin(r.between(0.06f, 0.85f)), around = r.between(0, 2 * kPi);
    sun_ = {std::cos(height) * std::sin(around), std::sin(height), -std::cos(height) * std::cos(around)};
    sky_ = ClearSky(turbidity_, sun_);
    weigh_sky(height);
    const float place = r.unit();
    ground_ = place < 0.5f ? glm::vec3(r.between(0.06f, 0.2f)) : glm::vec3(0.06f, 0.1f, 0.03f) * r.between(0.7f, 1.6f);
    if (r.chance(0.05f)) ground_ = glm::vec3(0.75f);  // snow
    hills_ = r.chance(0.5f) ? r.between(0.01f, 0.12f) : 0.f;
    hill_color_ = glm::vec3(0.07f, 0.1f, 0.06f) * r.between(0.6f, 1.5f), key_ = r.bits();
    for (int i = place < 0.5f ? r.whole(6, 22) : r.whole(0, 4); i > 0; --i) add_house(r);
    for (int i = place < 0.5f ? r.whole(0, 9) : r.whole(5, 26); i > 0; --i) add_tree(r);
    // Nearer things cover what is behind them.
    std::stable_sort(standing_.begin(), standing_.end(), [](const auto& a, const auto& b) { return a.foot < b.foot; });
  }

  float sun_azimuth() const { return std::atan2(sun_.x, -sun_.z); }

  glm::vec3 operator()(const glm::vec3& d) const {
    const float around = std::atan2(d.x, -d.z), up = std::asin(std::clamp(d.y, -1.f, 1.f));
    for (const Standing& s : standing_) {
      float off = around - s.middle;
      off += off > kPi ? -2 * kPi : off < -kPi ? 2 * kPi : 0;
      if (std::abs(off) > s.half || up > s.top || up < s.foot) continue;
      off /= s.half;
      if (!s.tree) return facade(s, off, up);
      if (in_crown(s, off, up)) return leaves(s, off, up);
    }
    // On a circle, so that the noise closes.
    const float ridge = hills_ * fractal(3 * std::sin(around) + 9, 3 * std::cos(around) + 9, key_);
    if (up > 0) return up < ridge ? lit(hill_color_, {-std::sin(around), 0.6f, std::cos(around)}) : above(d);
    const glm::vec2 at = glm::vec2(d.x, d.z) / std::max(-d.y, 0.02f);  // in heights of the window
    return lit(ground_, {0, 1, 0}) * (0.7f + 0.6f * fractal(1.5f * at.x, 1.5f * at.y, key_ + 5));
  }

 private:
  /// Sky, sun and ground in one unit: the sky's irradiance on level ground is pi.
  void weigh_sky(float height) {
    glm::vec3 clear(0);
    for (int y = 0; y < kHeight / 2; ++y)
      for (int x = 0; x < kWidth; x += 4) {
        const glm::vec3 d(panorama_direction(x, y, kWidth, kHeight));
        clear += 4 * static_cast<float>(panorama_solid_angle(y, kWidth, kHeight)) * d.y * sky_(d);
      }
    clear_ = kPi / (0.2126f * clear.x + 0.7152f * clear.y + 0.0722f * clear.z);
    const float disc = 2 * kPi * (1 - std::cos(sun_radius_));
    sun_light_ = through_air(turbidity_, height) * (kPi * sun_share_ * (1 - cloud_));
    sun_radiance_ = sun_light_ / disc;
  }

  glm::vec3 above(const glm::vec3& d) const {
    const glm::vec2 at = glm::vec2(d.x, d.z) / (d.y + 0.12f);
    const float mass = fractal(1.2f * at.x, 1.2f * at.y, key_ + 9);
    const glm::vec3 grey = glm::vec3(0.97f, 1, 1.05f) * (3 * (1 + 2 * d.y) / 7);  // irradiance pi
    // Whole covers are mottled, broken ones have gaps.
    const float cover = std::clamp(cloud_ + 4 * cloud_ * (1 - cloud_) * (4 * mass - 2), 0.f, 1.f);
    glm::vec3 c = sky_(d) * clear_ * (1 - cover) + grey * (cover * (0.75f + 0.5f * mass));
    const float angle = std::acos(std::clamp(glm::dot(d, sun_), -1.f, 1.f));
    if (angle < sun_radius_) c += sun_radiance_;
    return c;
  }

  /// What a surface sends back of sky and sun; upright ones see half of the sky, and the ground.
  glm::vec3 lit(const glm::vec3& albedo, const glm::vec3& normal) const {
    const glm::vec3 n = glm::normalize(normal);
    return albedo * (glm::vec3(0.5f + 0.5f * n.y) + sun_light_ * (std::max(glm::dot(n, sun_), 0.f) / kPi));
  }

  void add_house(Random& r) {
    Standing s;
    s.middle = r.between(-kPi, kPi), s.half = r.between(0.08f, 0.5f);
    // What is near reaches higher up and farther down.
    const float near = r.unit() * r.unit();
    const float far_top = r.between(0.05f, 0.2f), rise = r.between(0.3f, 0.9f);  // a draw a statement: order is fixed
    s.top = far_top + near * rise, s.foot = -(0.03f + 0.6f * near);
    const float value = r.between(0.1f, 0.55f);
    const float blue = r.between(0.45f, 1), green = r.between(0.7f, 1);
    s.color = glm::vec3(1, green, blue) * value;
    s.floors = static_cast<float>(r.whole(2, 7)), s.columns = static_cast<float>(r.whole(2, 9)), s.key = r.bits();
    standing_.push_back(s);
  }
  void add_tree(Random& r) {
    Standing s;
    s.tree = true, s.middle = r.between(-kPi, kPi), s.key = r.bits();
    const float near = r.unit() * r.unit();
    s.top = r.between(0.05f, 0.2f) + 0.7f * near, s.foot = -(0.02f + 0.45f * near);
    s.half = (s.top - s.foot) * r.between(0.3f, 0.65f);
    const float blue = r.between(0.02f, 0.05f), green = r.between(0.07f, 0.16f), red = r.between(0.03f, 0.12f);
    s.color = glm::vec3(red, green, blue);
    standing_.push_back(s);
  }

  static bool in_crown(const Standing& s, float off, float up) {
    const float middle = s.foot + 0.6f * (s.top - s.foot), half = 0.4f * (s.top - s.foot);
    if (up < middle - half) return std::abs(off) < 0.08f;  // the trunk
    const float y = (up - middle) / half, edge = 0.7f + 0.7f * (noise(off * 5 + 20, 5 * y + 20, s.key) - 0.5f);
    return off * off + y * y < edge;
  }
  glm::vec3 leaves(const Standing& s, float off, float up) const {
    const float clump = noise(off * 9 + 30, (up - s.foot) / (s.top - s.foot) * 14, s.key + 1);
    const glm::vec3 n(std::sin(s.middle) * -1 + 0.6f * off, 0.6f, std::cos(s.middle));
    return lit(s.color, n) * (0.3f + 1.4f * clump);
  }
  glm::vec3 facade(const Standing& s, float off, float up) const {
    const glm::vec3 towards_us(-std::sin(s.middle), 0, std::cos(s.middle));
    const float x = (off * 0.5f + 0.5f) * s.columns, y = (up - s.foot) / (s.top - s.foot) * s.floors;
    const float fx = x - std::floor(x), fy = y - std::floor(y);
    const bool pane = fx > 0.28f && fx < 0.72f && fy > 0.25f && fy < 0.78f;
    if (!pane) return lit(s.color, towards_us);
    return glm::vec3(0.1f, 0.12f, 0.15f) * (0.5f + noise(std::floor(x), std::floor(y), s.key));
  }

  float sun_share_, sun_radius_;
  float cloud_ = 0, turbidity_ = 3, clear_ = 1, hills_ = 0;
  glm::vec3 sun_{0, 1, 0}, sun_light_{0}, sun_radiance_{0}, ground_{0}, hill_color_{0};
  ClearSky sky_{3, {0, 1, 0}};
  std::vector<Standing> standing_;
  std::uint64_t key_ = 0;
};

Panorama panorama_of(const View& view) {
  Panorama p{kWidth, kHeight, {}};
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const glm::vec3 c = view(glm::vec3(panorama_direction(x, y, kWidth, kHeight)));
      p.rgb.insert(p.rgb.end(), {c.x, c.y, c.z});
      sum += static_cast<double>(c.x + c.y + c.z);
    }
  const auto scale = static_cast<float>(static_cast<double>(p.rgb.size()) / sum);
  for (float& v : p.rgb) v *= scale;
  return p;
}

std::optional<std::uint64_t> seed_after(std::string_view prefix, const std::string& name) {
  if (!name.starts_with(prefix) || name.size() != prefix.size() + 16) return std::nullopt;
  std::uint64_t seed = 0;
  const char* end = name.data() + name.size();
  const auto [at, error] = std::from_chars(name.data() + prefix.size(), end, seed, 16);
  return error == std::errc() && at == end ? std::optional(seed) : std::nullopt;
}

}  // namespace

Panorama make_sky(std::uint64_t seed) { return panorama_of(View{Random(seed)}); }
Panorama make_sunny_sky(std::uint64_t seed) { return panorama_of(View{Random(seed), true}); }
float sun_azimuth(std::uint64_t seed) { return View{Random(seed), true}.sun_azimuth(); }

std::string sky_name(std::uint64_t seed) { return fmt::format("{}{:016x}", kPrefix, seed); }
std::optional<std::uint64_t> sky_seed(const std::string& name) { return seed_after(kPrefix, name); }
std::string sunny_name(std::uint64_t seed) { return fmt::format("{}{:016x}", kSunnyPrefix, seed); }
std::optional<std::uint64_t> sunny_seed(const std::string& name) { return seed_after(kSunnyPrefix, name); }

}  // namespace clerestory
