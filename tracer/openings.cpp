#include "tracer/openings.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {
namespace {

/// The four sides of an opening, `depth` into the wall.
void reveal(Shapes& s, const Opening& o, float depth, int material) {
  s.quad({o.x0, o.y0, -depth}, {o.x0, o.y0, 0}, {o.x0, o.y1, 0}, {o.x0, o.y1, -depth}, material);
  s.quad({o.x1, o.y0, 0}, {o.x1, o.y0, -depth}, {o.x1, o.y1, -depth}, {o.x1, o.y1, 0}, material);
  s.quad({o.x0, o.y1, 0}, {o.x1, o.y1, 0}, {o.x1, o.y1, -depth}, {o.x0, o.y1, -depth}, material);
  s.quad({o.x0, o.y0, -depth}, {o.x1, o.y0, -depth}, {o.x1, o.y0, 0}, {o.x0, o.y0, 0}, material);
}

/// Four bars around a rectangle, the outer edge given.
void bars(Shapes& s, const glm::vec2& low, const glm::vec2& high, float bar, float z0, float z1, int material) {
  s.box({low.x, low.y, z0}, {low.x + bar, high.y, z1}, material);
  s.box({high.x - bar, low.y, z0}, {high.x, high.y, z1}, material);
  s.box({low.x + bar, low.y, z0}, {high.x - bar, low.y + bar, z1}, material);
  s.box({low.x + bar, high.y - bar, z0}, {high.x - bar, high.y, z1}, material);
}

void handle(Shapes& s, const glm::vec3& at, float inwards, int metal) {
  s.box({at.x - 0.018f, at.y - 0.08f, at.z}, {at.x + 0.018f, at.y + 0.08f, at.z + 0.006f}, metal);
  s.tube({{at.x, at.y + 0.04f, at.z},
          {at.x, at.y + 0.04f, at.z + 0.05f},
          {at.x + inwards * 0.12f, at.y + 0.04f, at.z + 0.05f}},
         0.009f, metal);
}

/// One casement: its own bars, glazing bars, a handle.
void casement(Shapes& s, const glm::vec2& low, const glm::vec2& high, float bar, float z0, float z1, int columns,
              int rows, int frame, int metal) {
  bars(s, low, high, bar, z0, z1, frame);
  for (int i = 1; i < columns; ++i) {
    const float x = low.x + (high.x - low.x) * static_cast<float>(i) / static_cast<float>(columns);
    s.box({x - 0.011f, low.y + bar, z0 + 0.01f}, {x + 0.011f, high.y - bar, z1 - 0.005f}, frame);
  }
  for (int i = 1; i < rows; ++i) {
    const float y = low.y + (high.y - low.y) * static_cast<float>(i) / static_cast<float>(rows);
    s.box({low.x + bar, y - 0.011f, z0 + 0.011f}, {high.x - bar, y + 0.011f, z1 - 0.006f}, frame);
  }
  s.box({high.x - bar * 0.7f, (low.y + high.y) / 2 - 0.06f, z1},
        {high.x - bar * 0.3f, (low.y + high.y) / 2 + 0.06f, z1 + 0.03f}, metal);
}

void mouldings(Shapes& s, const Opening& o, int rows, int columns, float z, int leaf) {
  for (int i = 0; i < rows * columns; ++i) {
    const auto share = [](int k, int of) { return static_cast<float>(k) / static_cast<float>(of); };
    const int row = i / columns, column = i % columns;
    const float w = o.x1 - o.x0 - 0.18f, h = o.y1 - 0.22f;
    const float x0 = o.x0 + 0.09f + w * share(column, columns) + 0.03f,
                x1 = o.x0 + 0.09f + w * share(column + 1, columns) - 0.03f;
    const float y0 = 0.11f + h * share(row, rows) + 0.04f, y1 = 0.11f + h * share(row + 1, rows) - 0.04f;
    bars(s, {x0, y0}, {x1, y1}, 0.025f, z, z + 0.008f, leaf);
  }
}

void sheet(Shapes& s, float x0, float y0, float x1, float y1, float z, int material) {
  s.quad({x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}, material, -1, {x0 + 8, y0});
}

}  // namespace

void window(Shapes& s, const Opening& o, int wall, int frame, int metal, int pane, int light) {
  Random& r = s.random();
  const float depth = r.between(0.1f, 0.28f), bar = r.between(0.035f, 0.07f);
  reveal(s, o, depth, wall);
  const float z0 = -depth, z1 = -depth + 0.05f;
  bars(s, {o.x0, o.y0}, {o.x1, o.y1}, 0.035f, z0, z1, frame);
  const int columns = std::max(1, static_cast<int>((o.x1 - o.x0) / r.between(0.55f, 1.4f)));
  const float fanlight = r.chance(0.25f) ? (o.y1 - o.y0) * r.between(0.6f, 0.75f) : o.y1 - o.y0;
  const bool glazed = r.chance(0.25f);
  for (int i = 0; i < columns; ++i) {
    const float each = (o.x1 - o.x0 - 0.06f) / static_cast<float>(columns),
                x = o.x0 + 0.03f + each * static_cast<float>(i);
    casement(s, {x, o.y0 + 0.03f}, {x + each, o.y0 + fanlight}, bar, z0 + 0.012f, z1 + 0.012f, glazed ? 2 : 1,
             glazed ? 3 : 1, frame, metal);
    if (fanlight < o.y1 - o.y0)
      bars(s, {x, o.y0 + fanlight}, {x + each, o.y1 - 0.03f}, bar * 0.8f, z0 + 0.012f, z1 + 0.012f, frame);
  }
  s.quad({o.x0, o.y0, z0 + 0.02f}, {o.x1, o.y0, z0 + 0.02f}, {o.x1, o.y1, z0 + 0.02f}, {o.x0, o.y1, z0 + 0.02f}, pane,
         light);
  s.box({o.x0 - 0.04f, o.y0 - 0.025f, -depth + 0.05f}, {o.x1 + 0.04f, o.y0 + 0.004f, 0.04f}, frame);  // sill
  if (r.chance(0.3f))
    bars(s, {o.x0 - kCasing, o.y0 - kCasing}, {o.x1 + kCasing, o.y1 + kCasing}, kCasing, 0, 0.015f, frame);
}

void casing(Shapes& s, const Opening& o, int frame) {
  const float wide = kCasing - 0.005f;
  s.box({o.x0 - wide, 0, 0}, {o.x0, o.y1 + wide, 0.018f}, frame);
  s.box({o.x1, 0, 0}, {o.x1 + wide, o.y1 + wide, 0.018f}, frame);
  s.box({o.x0, o.y1, 0}, {o.x1, o.y1 + wide, 0.018f}, frame);
}

void door(Shapes& s, const Opening& o, int wall, int frame, int leaf, int metal, int pane) {
  Random& r = s.random();
  reveal(s, o, 0.12f, wall);
  casing(s, o, frame);
  const float z = -0.03f;
  s.box({o.x0, o.y0, z - 0.04f}, {o.x1, o.y1, z}, leaf);
  const int style = r.whole(0, 4);
  if (style == 1) mouldings(s, o, r.whole(1, 3), 1, z, leaf);
  if (style == 2) mouldings(s, o, r.whole(2, 3), 2, z, leaf);
  if (style == 3) {  // a light of dark glass
    const float x0 = o.x0 + 0.18f, x1 = o.x1 - 0.18f, y0 = r.between(0.9f, 1.1f), y1 = o.y1 - 0.2f;
    bars(s, {x0, y0}, {x1, y1}, 0.03f, z, z + 0.01f, leaf);
    sheet(s, x0 + 0.03f, y0 + 0.03f, x1 - 0.03f, y1 - 0.03f, z + 0.003f, pane);
  }
  const float x = r.chance(0.5f) ? o.x0 + 0.07f : o.x1 - 0.07f;
  handle(s, {x, 1.f, z}, x < (o.x0 + o.x1) / 2 ? 1.f : -1.f, metal);
}

void recess_sides(Shapes& s, const Opening& o, int wall) {
  const float d = o.depth;
  s.quad({o.x0, o.y0, -d}, {o.x0, o.y0, 0}, {o.x0, o.y1, 0}, {o.x0, o.y1, -d}, wall, -1, {8, o.y0});
  s.quad({o.x1, o.y0, 0}, {o.x1, o.y0, -d}, {o.x1, o.y1, -d}, {o.x1, o.y1, 0}, wall, -1, {8, o.y0});
  if (o.kind != Opening::Niche) return;
  s.quad({o.x0, o.y1, 0}, {o.x1, o.y1, 0}, {o.x1, o.y1, -d}, {o.x0, o.y1, -d}, wall);
  s.quad({o.x0, o.y0, -d}, {o.x1, o.y0, -d}, {o.x1, o.y0, 0}, {o.x0, o.y0, 0}, wall);
}

void radiator(Shapes& s, const Opening& o, int material) {
  const float x0 = o.x0 + 0.1f, x1 = o.x1 - 0.1f, top = std::min(o.y0 - 0.12f, 0.7f);
  if (x1 - x0 < 0.4f || top < 0.35f) return;
  if (s.random().chance(0.5f)) {  // a flat panel with shallow ribs
    s.box({x0, 0.12f, 0.04f}, {x1, top, 0.1f}, material);
    for (float x = x0 + 0.02f; x < x1 - 0.03f; x += 0.033f)
      s.box({x, 0.15f, 0.1f}, {x + 0.02f, top - 0.03f, 0.106f}, material);
  } else {
    const int fins = static_cast<int>((x1 - x0) / 0.06f);
    for (int i = 0; i < fins; ++i) {
      const float x = x0 + 0.06f * static_cast<float>(i);
      s.box({x, 0.12f, 0.03f}, {x + 0.045f, top, 0.12f}, material);
    }
    s.box({x0, top - 0.05f, 0.05f}, {x1, top - 0.02f, 0.1f}, material);
  }
  s.tube({{x1 + 0.02f, 0.04f, 0.06f}, {x1 + 0.02f, 0.18f, 0.06f}, {x1 - 0.02f, 0.18f, 0.06f}}, 0.009f, material);
}

void curtains(Shapes& s, const Opening& o, float height, const Kit& kit) {
  Random& r = s.random();
  const int cloth = s.material(r.chance(0.6f) ? kit.palette->fabric() : kit.palette->make(MaterialClass::Fabric));
  const int metal = s.material(r.chance(0.6f) ? kit.palette->chrome() : kit.palette->wood());
  const float top = r.chance(0.3f) ? height - 0.05f : std::min(o.y1 + 0.15f, height - 0.06f);
  const float low = o.y0 < 0.4f || r.chance(0.6f) ? 0.03f : o.y0 - 0.15f;
  s.tube({{o.x0 - 0.35f, top, 0.09f}, {o.x1 + 0.35f, top, 0.09f}}, 0.012f, metal);
  for (const float x : {o.x0 - 0.35f, o.x1 + 0.35f}) s.sphere({x, top, 0.09f}, 0.025f, metal, 6);
  // Drawn aside, half drawn, or nearly closed.
  const float share = r.chance(0.75f) ? r.between(0.14f, 0.34f) : r.between(0.4f, 0.56f);
  const float wide = std::max((o.x1 - o.x0 + 0.5f) * share, 0.2f);
  const int folds = std::max(2, static_cast<int>(wide / r.between(0.07f, 0.12f)));
  const float deep = r.between(0.02f, 0.035f);
  s.curtain({o.x0 - 0.25f, low, 0.09f}, wide, top - low - 0.01f, deep, folds, cloth);
  if (r.chance(0.85f)) s.curtain({o.x1 + 0.25f - wide, low, 0.09f}, wide, top - low - 0.01f, deep, folds, cloth);
}

void blind(Shapes& s, const Opening& o, const Kit& kit) {
  Random& r = s.random();
  const float x0 = o.x0 + 0.03f, x1 = o.x1 - 0.03f, z = -0.03f, down = (o.y1 - o.y0) * r.between(0.15f, 0.75f);
  if (r.chance(0.5f)) {  // a roller blind
    const int cloth = s.material(kit.palette->make(MaterialClass::Fabric));
    s.tube({{x0, o.y1 - 0.03f, z}, {x1, o.y1 - 0.03f, z}}, 0.022f, cloth, 10);
    sheet(s, x0, o.y1 - down, x1, o.y1 - 0.03f, z + 0.02f, cloth);
    s.box({x0, o.y1 - down - 0.02f, z + 0.014f}, {x1, o.y1 - down, z + 0.026f}, cloth);
    return;
  }
  const int slat = s.material(r.chance(0.6f) ? kit.palette->enamel() : kit.palette->wood());
  s.box({x0, o.y1 - 0.04f, z - 0.02f}, {x1, o.y1, z + 0.02f}, slat);
  const float step = 0.046f, lean = r.between(0.2f, 1.2f);
  for (int i = 1; static_cast<float>(i) * step < down; ++i) {
    const glm::mat4 pose(glm::vec4(1, 0, 0, 0), glm::vec4(0, std::cos(lean), std::sin(lean), 0),
                         glm::vec4(0, -std::sin(lean), std::cos(lean), 0),
                         glm::vec4(0, o.y1 - 0.04f - static_cast<float>(i) * step, z, 1));
    s.at(pose).box({x0, -0.001f, -0.024f}, {x1, 0.001f, 0.024f}, slat);
  }
}

}  // namespace clerestory
