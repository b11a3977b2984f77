// The families of procedural materials in plain double arithmetic: the formulas of kernels/trace/texture.clh.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>

#include "tracer/scene.hpp"

namespace clerestory::reference {

class TextureFormula {
 public:
  explicit TextureFormula(const Material& m) : m_(m), key_(mixed(static_cast<std::uint32_t>(m.seed))) {}

  /// Albedo 3, roughness, metallic at texture coordinates p, averaged over `footprint` metres.
  std::array<double, 5> operator()(const glm::dvec3& p, double footprint) const {
    Weights w = weights(p, footprint);
    if (m_.noise > 0) w.tint += left(45, footprint) * double{m_.noise} * (2 * noise(p * 90.0, key_ + 6) - 1);
    if (m_.stain != 0) w.tint += double{m_.stain} * clouds(p, double{m_.stain_scale}, key_ + 31, footprint);
    const auto blend = [&](const auto& a, const auto& b, const auto& c) {
      return (1 - w.c) * ((1 - w.b) * a + w.b * b) + w.c * c;
    };
    const auto number = [&](float a, float b, float c) {
      return std::clamp(blend(double{a}, double{b}, double{c}), 0.0, 1.0);
    };
    double roughness = number(m_.roughness_a, m_.roughness_b, m_.roughness_c);
    if (m_.smudge != 0) {
      const double more = double{m_.smudge} * clouds(p, double{m_.smudge_scale}, key_ + 37, footprint);
      roughness = std::clamp(roughness + more, 0.0, 1.0);
    }
    const double metallic = number(m_.metallic_a, m_.metallic_b, m_.metallic_c);
    const double most = m_.uncapped != 0 ? 1 : (1 - metallic) * 0.78 + metallic * 0.92;
    const glm::dvec3 color = w.tint * blend(glm::dvec3(m_.color_a), glm::dvec3(m_.color_b), glm::dvec3(m_.color_c));
    return {std::clamp(color.x, 0.0, most), std::clamp(color.y, 0.0, most), std::clamp(color.z, 0.0, most), roughness,
            metallic};
  }

 private:
  using V = glm::dvec3;
  struct Weights {
    double b = 0, c = 0, tint = 1;
  };

  static std::uint32_t mixed(std::uint32_t x) {
    x ^= x >> 16, x *= 0x85ebca6bu;
    x ^= x >> 13, x *= 0xc2b2ae35u;
    return x ^ (x >> 16);
  }
  static double cell(double x, double y, double z, std::uint32_t key) {
    const auto whole = [](double v) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(v))); };
    const std::uint32_t h = whole(x) * 0x8da6b343u ^ whole(y) * 0xd8163841u ^ whole(z) * 0xcb1ab31fu;
    return static_cast<double>(mixed(h ^ key) >> 8) / 16777216.0;
  }
  static double ease(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3 - 2 * t);
  }
  static double noise(const V& p, std::uint32_t key) {
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      V at;
      for (int axis = 0; axis < 3; ++axis) {
        const int far = corner >> axis & 1;
        const double t = ease(0, 1, p[axis] - std::floor(p[axis]));
        at[axis] = std::floor(p[axis]) + far;
        weight *= far ? t : 1 - t;
      }
      sum += weight * cell(at.x, at.y, at.z, key);
    }
    return sum;
  }
  static double cloud(const V& p, std::uint32_t key) {
    return (4 * noise(p, key) + 2 * noise(p * 2.03, key + 1) + noise(p * 4.01, key + 2)) / 7;
  }
  static double clouds(const V& p, double scale, std::uint32_t key, double footprint) {
    return left(2 * scale, footprint) * (2 * ease(0.3, 0.7, cloud(p * scale, key)) - 1);
  }
  static double wave(double turns) { return (1 + std::sin(2 * std::numbers::pi * turns)) / 2; }
  static double left(double waves, double footprint) { return 1 - ease(0.25, 1, waves * footprint); }
  static double dimmed(double value, double mean, double share) { return mean * (1 - share) + value * share; }

  /// Share of an interval that lies within `gap` of a whole number, cell by cell.
  static double line(double x, double gap, double width) {
    if (width <= 1e-3) return std::abs(x - std::round(x)) < gap ? 1 : 0;
    double covered = 0;
    for (double cell = std::floor(x - width / 2) - 1; cell <= std::ceil(x + width / 2) + 1; ++cell)
      covered += std::max(0.0, std::min(x + width / 2, cell + gap) - std::max(x - width / 2, cell - gap));
    return covered / width;
  }
  static double either(double u, double v) { return 1 - (1 - u) * (1 - v); }

  /// Prints: distances in repeats, inside of an edge where positive.
  static double inside(double distance, double width) {
    return std::clamp(distance / std::max(width, 0.02) + 0.5, 0.0, 1.0);
  }
  static double off(double x) { return x - std::floor(x) - 0.5; }
  double at(double x, double y, double z) const { return cell(x, y, z, key_); }

  struct Print {
    double b = 0, c = 0, mean_b = 0.5, mean_c = 0;
  };
  Print print(const V& p, double x, double y, double width) const {
    const double mx = std::abs(off(x)), my = std::abs(off(y));
    const bool odd_row = std::fmod(std::floor(y), 2) != 0, odd_column = std::fmod(std::floor(x), 2) != 0;
    switch (static_cast<int>(m_.pattern)) {
      case 0:
        return {inside(0.1 + 0.35 * at(x, 0, 1) - mx, width),
                at(x, 0, 2) > 0.5 ? inside(0.05 - std::abs(off(x + 0.3)), width) : 0, 0.55, 0.05};
      case 1:
        return {(inside(0.3 - mx, width) + inside(0.3 - my, width)) / 2,
                either(inside(0.04 - std::abs(off(x + 0.35)), width), inside(0.04 - std::abs(off(y + 0.35)), width)),
                0.6, 0.154};
      case 2: {
        const double far = std::hypot(off(x) - 0.4 * (at(x, y, 1) - 0.5), off(y) - 0.4 * (at(x, y, 2) - 0.5));
        const double radius = 0.12 + 0.15 * at(x, y, 3);
        return {inside(radius - far, width), at(x, y, 4) > 0.6 ? inside(radius / 2 - far, width) : 0, 0.125, 0.0125};
      }
      case 3: {
        const double motif = cloud(V(5 * mx, 5 * std::abs(off(y + (odd_column ? 0.5 : 0))), 0), key_);
        return {inside((motif - 0.5) / 4, width), inside((motif - 0.64) / 4, width), 0.5, 0.15};
      }
      case 4: {
        const double du = off(x) - 0.3 * (at(x, y, 1) - 0.5), dv = off(y) - 0.3 * (at(x, y, 2) - 0.5);
        const double size = 0.2 + 0.12 * at(x, y, 3), far = std::hypot(du, dv);
        const double angle = (4 + std::floor(4 * at(x, y, 4))) * std::atan2(dv, du);
        const double edge = size * (0.7 + 0.3 * std::cos(angle + 2 * std::numbers::pi * at(x, y, 5)));
        return {inside(edge - far, width), inside(0.3 * size - far, width), 0.116, 0.0195};
      }
      case 5: {
        const double along = y + 2 * mx;
        return {inside(0.25 - std::abs(off(along)), width), inside(0.04 - std::abs(off(along + 0.4)), width), 0.5,
                0.08};
      }
      case 6: {
        const double far = std::hypot(off(x + (odd_row ? 0.5 : 0)), off(y));
        return {inside((0.25 - std::abs(off(4 * far))) / 4, width), 0, 0.5, 0};
      }
      case 7:
        return {at(x, y, 1), at(x, y, 2) > 0.7 ? 1.0 : 0.0, 0.5, 0.3};
      case 8: {
        const double kind = at(x / 12, y / 8, 3), size = kind < 0.3 ? 1.0 / 3 : 1, s = x * size, t = y * size;
        const bool marked = at(1.6 * s, t, 1) > 0.2 && std::abs(off(t)) < 0.3 && at(6.4 * s, 5 * t, 7) > 0.45;
        const double ink = dimmed(marked ? 1 : 0, 0.26, 1 - ease(0.08, 0.4, width * size));
        return {kind < 0.15 || kind > 0.8 ? 0 : ink, kind > 0.8 ? 1.0 : 0.0, 0.17, 0.2};
      }
      case 9: {
        const double s = 0.7 * x + 0.37, t = 0.7 * y + 0.59, radius = 0.1 + 0.25 * at(s, t, 4);
        return {inside(std::min(0.08 + 0.2 * at(x, y, 1) - mx, 0.08 + 0.2 * at(x, y, 2) - my), width),
                inside((radius - std::hypot(off(s), off(t))) * 1.4, width), 0.13, 0.175};
      }
      case 10: {
        double first = 9, second = 9, value = 0;
        for (double j = std::floor(y) - 1; j <= std::floor(y) + 1; ++j)
          for (double i = std::floor(x) - 1; i <= std::floor(x) + 1; ++i) {
            const double far = std::hypot(i + 0.15 + 0.7 * at(i, j, 1) - x, j + 0.15 + 0.7 * at(i, j, 2) - y);
            if (far < first) value = at(i, j, 3);
            second = std::min(second, std::max(first, far)), first = std::min(first, far);
          }
        const double gap = double{m_.gap};
        return {value, inside(gap - (second - first) / 2, width), 0.5, std::min(4.2 * gap, 1.0)};
      }
      case 11: {
        const double strands = wave(4 * (odd_row != odd_column ? y : x));
        return {dimmed(strands, 0.5, 1 - ease(0.06, 0.25, width)), either(line(x, 0.04, width), line(y, 0.04, width)),
                0.5, 0.154};
      }
      default: {
        const V q = p * V(m_.scale);
        const double bend = double{m_.warp} * cloud(q, key_), soft = std::max(double{m_.gap}, 0.02);
        return {ease(0.5 - soft, 0.5 + soft, cloud(q + bend, key_ + 5)),
                ease(0.58, 0.58 + soft, cloud(q * 1.3 - bend, key_ + 8)), 0.5, 0.2};
      }
    }
  }

  Weights weights(const V& p, double footprint) const {
    const V scale(m_.scale);
    const double gap = double{m_.gap}, tint = double{m_.tint}, warp = double{m_.warp}, wear = double{m_.wear};
    const int pattern = static_cast<int>(m_.pattern);
    const auto varied = [tint](double value) { return 1 + tint * (2 * value - 1); };
    Weights w;
    switch (static_cast<Texture>(static_cast<int>(m_.texture))) {
      case Texture::Plain:
      case Texture::Plaster:
        w.b = cloud(p * scale, key_);
        if (wear > 0) w.c = ease(1 - wear, 1, cloud(p * scale * 0.37, key_ + 9));
        break;
      case Texture::Wood: {
        const double across = p.y * scale.y, board = scale.y > 0 ? std::floor(across) : 0;
        const double shift = cell(board, 3, 7, key_);
        const double along = p.x * scale.x + 5 * shift, piece = scale.x > 0 ? std::floor(along) : 0;
        const double own = cell(board, piece, 11, key_);
        const V q(0.7 * p.x + 17 * own, p.y + 5 * own, p.z + shift);
        const double bend = noise(q * V(1.3, 7, 7), key_ + 1);
        const double rings = dimmed(wave((q.y + q.z) * scale.z + bend * warp), 0.5, left(scale.z, footprint));
        const double streaks = dimmed(noise(q * V(4, 160, 160), key_ + 2), 0.5, left(80, footprint));
        w.b = std::clamp(0.65 * rings + 0.55 * streaks - 0.1, 0.0, 1.0);
        if (gap > 0)
          w.c = either(scale.x > 0 ? line(along, gap * scale.x / scale.y, footprint * scale.x) : 0,
                       line(across, gap, footprint * scale.y));
        w.tint = varied(own);
        break;
      }
      case Texture::Tiles: {
        const double y = p.y * scale.y, row = std::floor(y);
        const double x = p.x * scale.x + (pattern == 1 && std::fmod(row, 2) != 0 ? 0.5 : 0), column = std::floor(x);
        const double own = cell(column, row, 1, key_);
        w.b = pattern == 2 ? (std::fmod(row + column, 2) != 0 ? 1 : 0) : cloud(V(x, y, 31 * own) * warp, key_ + 1);
        w.c = either(line(x, gap, footprint * scale.x), line(y, gap * scale.y / scale.x, footprint * scale.y));
        w.tint = varied(own);
        break;
      }
      case Texture::Fabric: {
        const double u = (p.x + 0.31 * p.z) * scale.x, v = (p.y + 0.27 * p.z) * scale.y;
        const double thread = dimmed(wave(16 * u) * wave(16 * v), 0.25, left(16 * scale.x, footprint));
        if (pattern == 1)
          w.b = ease(0.45, 0.55, wave(u));
        else if (pattern == 2)
          w.b = (ease(0.6, 0.7, wave(u)) + ease(0.6, 0.7, wave(v))) / 2;
        else
          w.b = cloud(p * scale * 3.0, key_);
        w.b = std::clamp(w.b + 0.35 * (thread - 0.25), 0.0, 1.0);
        w.tint = varied(thread);
        break;
      }
      case Texture::Stone: {
        const V q = p * scale;
        if (pattern == 1) {
          w.b = ease(0.5, 0.62, noise(q * 9.0, key_));
          w.c = ease(0.68, 0.74, noise(q * 13.0, key_ + 5));
        } else {
          w.b = cloud(q, key_);
          w.c = ease(0.86, 0.99, 1 - std::abs(2 * cloud(q * 1.7 + w.b * warp, key_ + 3) - 1));
        }
        if (gap > 0) {
          w.tint = varied(cell(p.x / gap, p.y / gap, 3, key_));
          w.c = either(w.c, either(line(p.x / gap, 0.002 / gap, footprint / gap),
                                   line(p.y / gap, 0.002 / gap, footprint / gap)));
        }
        break;
      }
      case Texture::Metal:
        w.b = dimmed(noise(p * scale, key_), 0.5, left(0.5 * scale.y, footprint));
        if (wear > 0) w.c = ease(1 - wear, 1.1 - 0.5 * wear, cloud(p * 5.0, key_ + 4) + 0.2 * w.b);
        break;
      case Texture::Leather:
        w.b = dimmed(ease(0, 0.35, std::abs(2 * noise(p * scale, key_) - 1)), 0.8, left(0.5 * scale.x, footprint));
        if (wear > 0) w.c = ease(1 - wear, 1, cloud(p * 3.0, key_ + 4));
        break;
      case Texture::Rug: {
        const double x = p.x * scale.x, y = p.y * scale.y;
        const double motif = wave(x) * wave(y) + wave(x + y) * wave(x - y) / 2;
        if (pattern == 1)
          w.b = ease(0.48, 0.52, wave(x));
        else if (pattern == 2)
          w.b = ease(0.4, 0.5, wave(1.5 * scale.x * std::hypot(p.x, p.y)));
        else
          w.b = ease(0.35, 0.45, motif);
        const double edge = std::max(std::abs(p.x), std::abs(p.y));
        w.c = (edge > 0.8 && edge < 0.9) || (pattern == 0 && motif > 0.95) ? 1 : 0;
        w.tint = varied(noise(p * 120.0, key_));
        break;
      }
      case Texture::Painting: {
        const V q(p.x * scale.x, p.y * scale.y, 0);
        const double bend = cloud(q, key_);
        if (pattern == 1) {
          w.b = ease(-0.05, 0.05, p.y + 0.25 + (bend - 0.5) / 2);
          w.c = w.b * ease(0.5, 0.7, cloud(q * V(1, 3, 1), key_ + 7));
        } else if (pattern == 2) {
          const double x = q.x + 0.3 * bend;
          w.b = ease(0.35, 0.4, cell(x, q.y, 1, key_));
          w.c = ease(0.7, 0.71, cell(x, q.y, 2, key_));
        } else {
          w.b = ease(0.4, 0.6, cloud(q + bend * warp, key_ + 5));
          w.c = ease(0.52, 0.62, cloud(q * 1.3 - bend * warp, key_ + 8));
        }
        w.tint = varied(noise(q * 40.0, key_ + 2));
        break;
      }
      case Texture::Print: {
        const double width = footprint * std::max(scale.x, scale.y), share = 1 - ease(0.5, 1.5, width);
        const Print print_of = print(p, (p.x + 0.61 * p.z) * scale.x, (p.y + 0.47 * p.z) * scale.y, width);
        w.b = dimmed(print_of.b, print_of.mean_b, share), w.c = dimmed(print_of.c, print_of.mean_c, share);
        w.tint = 1 + tint * left(60, footprint) * (2 * noise(p * 120.0, key_ + 2) - 1);
        break;
      }
    }
    return w;
  }

  Material m_;
  std::uint32_t key_;
};

}  // namespace clerestory::reference
