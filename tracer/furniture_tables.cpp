// Tables with what stands on and around them.
#include <algorithm>
#include <cmath>

#include "tracer/furniture.hpp"

namespace clerestory {
namespace {

/// Board and legs; style 0: four legs, 1: two panels, 2: a pillar (round tops), 3: trestle of metal.
void table(Shapes& s, float w, float h, float d, float thickness, int style, int top, int frame) {
  if (style == 2) {
    s.lathe({0, h - thickness, 0}, {{w / 2 - 0.01f, 0}, {w / 2, 0.01f}, {w / 2, thickness}}, top, 32);
    s.lathe({0, 0, 0}, {{w * 0.28f, 0}, {w * 0.27f, 0.03f}, {0.05f, 0.06f}, {0.04f, h - thickness}}, frame, 20);
    return;
  }
  s.box({-w / 2, h - thickness, -d / 2}, {w / 2, h, d / 2}, top);
  if (style == 1) {
    for (const float x : {-1.f, 1.f}) {
      const float at = x * (w / 2 - 0.06f);
      s.box({at - 0.02f, 0, -d / 2 + 0.03f}, {at + 0.02f, h - thickness, d / 2 - 0.03f}, frame);
    }
    return;
  }
  const float leg = style == 3 ? 0.03f : 0.055f;
  for (const float x : {-1.f, 1.f}) {
    for (const float z : {-1.f, 1.f}) {
      const glm::vec3 head(x * (w / 2 - 0.07f), h - thickness, z * (d / 2 - 0.06f));
      const float spread = style == 3 ? 0.04f : 0;
      s.rod(head, {head.x + x * spread, 0, head.z + z * spread}, leg, frame);
    }
  }
  if (style == 0) {  // apron
    s.box({-w / 2 + 0.06f, h - thickness - 0.08f, -d / 2 + 0.05f}, {w / 2 - 0.06f, h - thickness, -d / 2 + 0.07f},
          frame);
    s.box({-w / 2 + 0.06f, h - thickness - 0.08f, d / 2 - 0.07f}, {w / 2 - 0.06f, h - thickness, d / 2 - 0.05f}, frame);
  }
}

}  // namespace

Piece dining_table(const Kit& kit, Random& random) {
  const bool round = random.chance(0.25f);
  const float w = round ? random.between(0.9f, 1.3f) : random.between(1.1f, 2.0f);
  const float d = round ? w : random.between(0.75f, 1.0f), h = random.between(0.72f, 0.77f);
  const float thickness = random.between(0.025f, 0.05f);
  const int style = round ? 2 : random.one_of({0, 0, 1, 3});
  const Material top = kit.palette->top();
  const Material frame = style == 3 || random.chance(0.2f) ? kit.palette->metal() : top;
  const Piece seat = chair(kit, random);
  const int along = round ? 2 : std::max(1, static_cast<int>(w / 0.65f));
  const bool heads = round || random.chance(0.4f);
  const int things = random.whole(2, 6);
  const float pulled = random.between(0.05f, 0.3f);
  const bool runner = random.chance(0.35f);
  const Material cloth = kit.palette->print();
  const glm::vec3 size(w + (heads ? 0.9f : 0.1f), h, d + 0.9f);
  return {"dining_table", size, [=](Shapes& s) {
            table(s, w, h, d, thickness, style, s.material(top), s.material(frame));
            const auto put = [&](float x, float z, float turn) {
              Random& r = s.random();
              if (r.chance(0.12f)) return;
              Shapes one = s.at({x + r.between(-0.06f, 0.06f), 0, z}, turn + r.between(-0.25f, 0.25f));
              seat.build(one);
            };
            const float out = d / 2 - 0.12f + pulled + (style == 1 ? 0.1f : 0.f);
            if (round) {
              for (int i = 0; i < 4; ++i) {
                const float a = 1.5708f * static_cast<float>(i);
                put(out * std::sin(a), out * std::cos(a), a + 3.14159f);
              }
            } else {
              for (int i = 0; i < along; ++i) {
                const float x = -w / 2 + w * (static_cast<float>(i) + 0.5f) / static_cast<float>(along);
                put(x, out, 3.14159f);
                put(x, -out, 0);
              }
              if (heads) put(w / 2 + pulled - 0.1f, 0, -1.5708f), put(-w / 2 - pulled + 0.1f, 0, 1.5708f);
            }
            Shapes on = s.at({0, h, 0});
            if (runner) {
              const float x = (round ? 0.3f : 0.46f) * w, z = 0.16f * d;
              on.box({-x, 0, -z}, {x, 0.002f, z}, on.material(cloth));
            }
            Shapes above = s.at({0, h + (runner ? 0.002f : 0.f), 0});
            clutter(above, kit, (round ? 0.6f : 0.85f) * w, (round ? 0.6f : 0.8f) * d, 0.6f, things);
          }};
}

Piece coffee_table(const Kit& kit, Random& random) {
  const bool round = random.chance(0.3f);
  const float w = random.between(0.7f, 1.2f), d = round ? w : random.between(0.45f, 0.7f),
              h = random.between(0.35f, 0.45f);
  const Material top = kit.palette->top(), frame = random.chance(0.5f) ? top : kit.palette->metal();
  const int style = round ? 2 : random.one_of({0, 1, 3}), things = random.whole(1, 4);
  const bool shelf = !round && random.chance(0.4f), runner = random.chance(0.15f);
  const Material cloth = kit.palette->print();
  return {"coffee_table", {w, h, d}, [=](Shapes& s) {
            const int t = s.material(top);
            table(s, w, h, d, 0.035f, style, t, s.material(frame));
            if (shelf) s.box({-w / 2 + 0.05f, 0.12f, -d / 2 + 0.05f}, {w / 2 - 0.05f, 0.14f, d / 2 - 0.05f}, t);
            Shapes on = s.at({0, h, 0});
            if (runner) on.box({-w * 0.3f, 0, -d * 0.2f}, {w * 0.3f, 0.002f, d * 0.2f}, on.material(cloth));
            Shapes above = s.at({0, h + (runner ? 0.002f : 0.f), 0});
            clutter(above, kit, w * 0.7f, d * 0.7f, 0.4f, things);
          }};
}

Piece desk(const Kit& kit, Random& random) {
  const float w = random.between(1.1f, 1.8f), d = random.between(0.6f, 0.8f), h = random.between(0.71f, 0.76f);
  const Material top = kit.palette->top(), frame = random.chance(0.5f) ? kit.palette->metal() : top;
  const Material drawers = kit.palette->body(), plastic = kit.palette->make(MaterialClass::Plastic);
  const Material screen = kit.palette->glass(), handle = kit.palette->metal();
  const Piece seat = random.chance(0.7f) ? office_chair(kit, random) : chair(kit, random);
  const int monitors = random.whole(0, 2), things = random.whole(2, 5);
  const float side = random.one_of({-1.f, 1.f});
  const bool lamp = random.chance(0.6f), lit = random.chance(0.2f);
  const glm::vec3 glow = lamp_color(random, *kit.palette) * glm::vec3(0.6f, 0.8f, 1.1f);
  return {
      "desk", {w, h, d + 0.5f}, [=](Shapes& whole) {
        Shapes s = whole.at({0, 0, -0.25f});
        table(s, w, h, d, 0.03f, frame.metallic_a > 0 ? 3 : 1, s.material(top), s.material(frame));
        const int body = s.material(drawers), metal = s.material(handle);
        const float x0 = side * (w / 2 - 0.08f), x1 = side * (w / 2 - 0.48f);
        const glm::vec3 low(std::min(x0, x1), 0.05f, -d / 2 + 0.05f), high(std::max(x0, x1), h - 0.04f, d / 2 - 0.08f);
        s.box(low, high, body);
        for (int i = 0; i < 3; ++i) {
          const float y = low.y + 0.02f + (high.y - low.y - 0.02f) / 3 * static_cast<float>(i);
          s.box({low.x + 0.01f, y, high.z}, {high.x - 0.01f, y + (high.y - low.y) / 3 - 0.03f, high.z + 0.018f}, body);
          s.box({(low.x + high.x) / 2 - 0.06f, y + 0.1f, high.z + 0.03f},
                {(low.x + high.x) / 2 + 0.06f, y + 0.115f, high.z + 0.042f}, metal);
        }
        const int p = s.material(plastic), g = s.material(screen);
        const int light = lit ? s.emitter({glow * 0.8f * kit.lamp_power, false}) : -1;
        for (int i = 0; i < monitors; ++i) {
          const float x = monitors == 1 ? -side * 0.1f : (i ? 0.3f : -0.3f);
          Shapes m = s.at({x, h, -d / 2 + 0.18f}, monitors == 1 ? 0 : (i ? -0.2f : 0.2f));
          m.block({0, 0, 0}, {0.2f, 0.012f, 0.16f}, p);
          m.block({0, 0, -0.03f}, {0.04f, 0.3f, 0.03f}, p);
          m.box({-0.27f, 0.13f, -0.015f}, {0.27f, 0.46f, 0.015f}, p);
          m.quad({-0.258f, 0.142f, 0.0155f}, {0.258f, 0.142f, 0.0155f}, {0.258f, 0.448f, 0.0155f},
                 {-0.258f, 0.448f, 0.0155f}, g, light);
        }
        if (monitors > 0) {
          s.block({-side * 0.1f, h, 0.08f}, {0.42f, 0.014f, 0.13f}, p);
          for (int row = 0; row < 5; ++row)
            s.block({-side * 0.1f, h + 0.014f, 0.03f + 0.024f * static_cast<float>(row)}, {0.4f, 0.005f, 0.018f}, g);
          s.cushion({-side * 0.1f + 0.26f, h, 0.04f}, {-side * 0.1f + 0.32f, h + 0.034f, 0.14f}, 0.016f, p, 2);
          s.tube({{-side * 0.1f, h + 0.005f, 0.01f},
                  {-side * 0.1f + 0.06f, h + 0.005f, -0.1f},
                  {-side * 0.1f, h + 0.005f, -d / 2 + 0.06f}},
                 0.003f, p, 5);
        }
        if (lamp) {
          Shapes l = s.at({side * (w / 2 - 0.2f), h, -d / 2 + 0.15f});
          table_lamp(l, kit, 0.42f);
        }
        Shapes chair_at =
            s.at({-side * 0.1f + s.random().between(-0.1f, 0.1f), 0, d / 2 + s.random().between(0.05f, 0.3f)},
                 3.14159f + s.random().between(-0.6f, 0.6f));
        seat.build(chair_at);
        Shapes on = s.at({-side * (w / 2 - 0.25f), h, 0.05f});
        clutter(on, kit, 0.35f, d * 0.7f, 0.4f, things);
      }};
}

Piece side_table(const Kit& kit, Random& random) {
  const bool round = random.chance(0.4f);
  const float w = random.between(0.38f, 0.5f), h = random.between(0.45f, 0.6f);
  const Material top = kit.palette->top(), frame = kit.palette->wood();
  const bool lamp = random.chance(0.6f), drawer = !round && random.chance(0.5f);
  return {"side_table", {w, h, w}, [=](Shapes& s) {
            const int t = s.material(top), f = s.material(frame);
            table(s, w, h, w, 0.025f, round ? 2 : 0, t, f);
            if (drawer) {
              s.box({-w / 2 + 0.05f, h - 0.19f, -w / 2 + 0.04f}, {w / 2 - 0.05f, h - 0.026f, w / 2 - 0.02f}, f);
              s.sphere({0, h - 0.1f, w / 2 - 0.01f}, 0.014f, s.material(kit.palette->metal()), 6);
            }
            Shapes on = s.at({0, h, 0});
            if (lamp)
              table_lamp(on, kit, s.random().between(0.38f, 0.55f));
            else
              clutter(on, kit, w * 0.7f, w * 0.7f, 0.4f, 2);
          }};
}

}  // namespace clerestory
