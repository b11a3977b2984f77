// Shelves, cabinets, kitchen rows, stacks of boxes.
#include <algorithm>

#include "tracer/furniture.hpp"

namespace clerestory {
namespace {

/// A door or drawer front with a gap around it and a handle; z is the plane of the body's front. style 1: framed; 2: a
/// bar of metal for a handle; 3: none, pushed open.
void front(Shapes& s, const glm::vec2& low, const glm::vec2& high, float z, int face, int handle, int style,
           bool drawer, float hinge) {
  const float gap = 0.003f, out = z + 0.018f;
  s.box({low.x + gap, low.y + gap, z + 0.001f}, {high.x - gap, high.y - gap, out}, face);
  if (style == 1) {  // a raised frame
    const float b = std::min(0.05f, (high.y - low.y) * 0.25f);
    const glm::vec2 l = low + gap, h = high - gap;
    s.box({l.x, l.y, out}, {h.x, l.y + b, out + 0.008f}, face);
    s.box({l.x, h.y - b, out}, {h.x, h.y, out + 0.008f}, face);
    s.box({l.x, l.y + b, out}, {l.x + b, h.y - b, out + 0.008f}, face);
    s.box({h.x - b, l.y + b, out}, {h.x, h.y - b, out + 0.008f}, face);
  }
  const glm::vec2 middle = (low + high) * 0.5f;
  if (style == 3) return;
  if (style == 2) {  // along the upper edge of drawers, along the free one of doors
    const float half = std::min(0.14f, (drawer ? high.x - low.x : high.y - low.y) * 0.3f);
    const float x = drawer      ? middle.x
                    : hinge < 0 ? high.x - 0.04f
                                : low.x + 0.04f,
                y = drawer ? high.y - 0.04f : middle.y;
    const glm::vec3 along = drawer ? glm::vec3(half, 0, 0) : glm::vec3(0, half, 0), at(x, y, out);
    const glm::vec3 away(0, 0, 0.03f);
    s.tube({at - along, at - along + away, at + along + away, at + along}, 0.006f, handle, 8);
    return;
  }
  if (drawer) {
    const float w = std::min(0.07f, (high.x - low.x) * 0.2f);
    s.box({middle.x - w, middle.y - 0.006f, out + 0.02f}, {middle.x + w, middle.y + 0.006f, out + 0.032f}, handle);
    s.box({middle.x - w, middle.y - 0.006f, out}, {middle.x - w + 0.01f, middle.y + 0.006f, out + 0.02f}, handle);
    s.box({middle.x + w - 0.01f, middle.y - 0.006f, out}, {middle.x + w, middle.y + 0.006f, out + 0.02f}, handle);
  } else {
    const float x = hinge < 0 ? high.x - 0.045f : low.x + 0.045f;
    s.sphere({x, middle.y, out + 0.02f}, 0.014f, handle, 6);
    s.rod({x, middle.y, out}, {x, middle.y, out + 0.01f}, 0.01f, handle);
  }
}

}  // namespace

Piece bookshelf(const Kit& kit, Random& random) {
  const float w = random.between(0.6f, 1.6f), h = random.between(0.9f, 2.1f), d = random.between(0.24f, 0.35f);
  const float board = random.between(0.018f, 0.03f);
  const Material body = kit.palette->body();
  const int shelves = std::max(2, static_cast<int>(h / random.between(0.3f, 0.42f)));
  const int columns = w > 1.1f ? 2 : 1;
  const bool back = random.chance(0.75f);
  const float full = random.between(0.4f, 0.95f);
  return {"bookshelf", {w, h, d}, [=](Shapes& s) {
            const int m = s.material(body);
            for (int c = 0; c <= columns; ++c) {
              const float x = -w / 2 + (w - board) * static_cast<float>(c) / static_cast<float>(columns);
              s.box({x, 0, -d / 2}, {x + board, h, d / 2}, m);
            }
            if (back) s.box({-w / 2 + 0.002f, 0.03f, -d / 2}, {w / 2 - 0.002f, h - 0.002f, -d / 2 + 0.008f}, m);
            const float inside = (w - board) / static_cast<float>(columns) - board;
            for (int i = 0; i <= shelves; ++i) {
              const float y = i == 0 ? 0.05f : (h - board) * static_cast<float>(i) / static_cast<float>(shelves);
              const float next = (h - board) * static_cast<float>(i + 1) / static_cast<float>(shelves);
              for (int c = 0; c < columns; ++c) {
                const float x = -w / 2 + board + (inside + board) * static_cast<float>(c);
                s.box({x, y, -d / 2 + 0.002f}, {x + inside, y + board, d / 2 - 0.002f}, m);
                if (i == shelves) continue;
                const float room = next - y - board;
                Random& r = s.random();
                Shapes at = s.at({x + 0.01f, y + board, 0});
                if (r.chance(full * 0.75f)) {
                  books(at, kit, (inside - 0.02f) * r.between(0.35f, 1.f), std::min(room - 0.03f, 0.3f),
                        std::min(d - 0.04f, 0.22f));
                } else if (r.chance(full)) {
                  Shapes middle = s.at({x + inside / 2, y + board, 0});
                  clutter(middle, kit, inside * 0.85f, d * 0.7f, room - 0.03f, r.whole(1, 3));
                }
              }
            }
          }};
}

Piece cabinet(const Kit& kit, Random& random) {
  const float w = random.between(0.8f, 1.8f), h = random.between(0.65f, 1.1f), d = random.between(0.38f, 0.5f);
  const Material body = kit.palette->body(), metal = kit.palette->metal(),
                 top = random.chance(0.3f) ? kit.palette->top() : body;
  const Material face = random.chance(0.7f) ? body : kit.palette->make(MaterialClass::GlossPaint);
  const int columns = std::max(2, static_cast<int>(w / 0.45f)), style = random.whole(0, 3), things = random.whole(1, 5);
  const bool legs = random.chance(0.5f);
  const int rows_of_drawers = random.whole(0, 2);
  return {"cabinet", {w, h, d}, [=](Shapes& s) {
            const int b = s.material(body), f = s.material(face), m = s.material(metal);
            const float foot = legs ? 0.14f : 0.05f;
            if (legs) {
              for (const float x : {-1.f, 1.f}) {
                for (const float z : {-1.f, 1.f})
                  s.block({x * (w / 2 - 0.05f), 0, z * (d / 2 - 0.05f)}, {0.035f, foot, 0.035f}, m);
              }
            } else {
              s.box({-w / 2 + 0.01f, 0, -d / 2}, {w / 2 - 0.01f, foot, d / 2 - 0.05f}, b);
            }
            s.box({-w / 2, foot, -d / 2}, {w / 2, h - 0.025f, d / 2 - 0.02f}, b);
            s.box({-w / 2 - 0.01f, h - 0.025f, -d / 2}, {w / 2 + 0.01f, h, d / 2}, s.material(top));
            const float each = w / static_cast<float>(columns), split = rows_of_drawers == 0 ? h - 0.028f : h - 0.2f;
            for (int c = 0; c < columns; ++c) {
              const float x = -w / 2 + each * static_cast<float>(c);
              if (rows_of_drawers == 2 && c == 0) {
                for (int i = 0; i < 3; ++i) {
                  const float y0 = foot + (h - 0.028f - foot) / 3 * static_cast<float>(i);
                  front(s, {x, y0}, {x + each, y0 + (h - 0.028f - foot) / 3}, d / 2 - 0.02f, f, m, style, true, 0);
                }
                continue;
              }
              front(s, {x, foot}, {x + each, split}, d / 2 - 0.02f, f, m, style, false, c % 2 ? 1.f : -1.f);
              if (rows_of_drawers > 0)
                front(s, {x, split}, {x + each, h - 0.028f}, d / 2 - 0.02f, f, m, style, true, 0);
            }
            Shapes on = s.at({0, h, 0});
            clutter(on, kit, w * 0.9f, d * 0.7f, 0.6f, things);
          }};
}

Piece wardrobe(const Kit& kit, Random& random, float height) {
  const bool built_in = random.chance(0.4f);
  const float w = random.between(0.9f, built_in ? 2.6f : 2.0f),
              h = built_in ? height - 0.02f : std::min(random.between(1.8f, 2.15f), height - 0.1f);
  const float d = random.between(0.55f, 0.62f);
  const Material body = kit.palette->body(), metal = kit.palette->metal();
  const Material face = random.chance(0.6f)    ? body
                        : random.chance(0.25f) ? kit.palette->mirror()
                                               : kit.palette->make(MaterialClass::GlossPaint);
  const int doors = std::max(2, static_cast<int>(w / 0.5f)), style = face.metallic_a > 0 ? 3 : random.whole(0, 3);
  const int boxes = built_in ? 0 : random.whole(0, 3);
  return {"wardrobe", {w, h, d}, [=](Shapes& s) {
            const int b = s.material(body), f = s.material(face), m = s.material(metal);
            s.box({-w / 2, 0, -d / 2}, {w / 2, h, d / 2 - 0.02f}, b);
            const float each = w / static_cast<float>(doors);
            for (int i = 0; i < doors; ++i) {
              const float x = -w / 2 + each * static_cast<float>(i);
              const float split = h > 2.3f ? 2.05f : h - 0.02f;
              front(s, {x, 0.07f}, {x + each, split}, d / 2 - 0.02f, f, m, style, false, i % 2 ? 1.f : -1.f);
              if (h > 2.3f)
                front(s, {x, split}, {x + each, h - 0.02f}, d / 2 - 0.02f, f, m, style, false, i % 2 ? 1.f : -1.f);
            }
            for (int i = 0; i < boxes; ++i) {  // what has no other place
              const float x = w * ((static_cast<float>(i) + 0.5f) / static_cast<float>(boxes) - 0.5f);
              const glm::vec3 size(w / static_cast<float>(boxes) * 0.8f, std::min(0.28f, height - h - 0.05f), d * 0.7f);
              if (size.y > 0.08f)
                s.block({x, h, 0}, size * s.random().between(0.6f, 1.f), s.material(kit.palette->trinket()));
            }
          }};
}

Piece kitchen_row(const Kit& kit, Random& random, float width) {
  const float h = 0.9f, d = 0.62f;
  const Material body = kit.palette->make(MaterialClass::GlossPaint), metal = kit.palette->metal();
  const Material top = random.chance(0.5f) ? kit.palette->make(MaterialClass::Stone) : kit.palette->wood();
  const Material splash = kit.palette->make(MaterialClass::Tile), glass = kit.palette->glass();
  const int units = std::max(2, static_cast<int>(width / 0.6f)), style = random.whole(0, 3);
  const bool upper = random.chance(0.7f), strip = upper && random.chance(0.5f * kit.lamp_on + 0.1f);
  const Material shade = kit.palette->diffuser(), chrome = kit.palette->chrome();
  const glm::vec3 glow = lamp_color(random, *kit.palette) * (random.between(6.f, 14.f) * kit.lamp_power);
  const int oven = random.whole(0, units - 1), things = random.whole(2, 6);
  return {"kitchen_row", {width, upper ? 2.15f : 1.5f, d}, [=](Shapes& s) {
            const int b = s.material(body), m = s.material(metal), g = s.material(glass);
            s.box({-width / 2, 0, -d / 2}, {width / 2, 0.1f, d / 2 - 0.07f}, b);
            s.box({-width / 2, 0.1f, -d / 2}, {width / 2, h - 0.04f, d / 2 - 0.03f}, b);
            s.box({-width / 2, h - 0.04f, -d / 2}, {width / 2, h, d / 2}, s.material(top));
            s.quad({-width / 2, h, -d / 2 + 0.006f}, {width / 2, h, -d / 2 + 0.006f},
                   {width / 2, 1.5f, -d / 2 + 0.006f}, {-width / 2, 1.5f, -d / 2 + 0.006f}, s.material(splash));
            const float each = width / static_cast<float>(units);
            for (int i = 0; i < units; ++i) {
              const float x = -width / 2 + each * static_cast<float>(i);
              if (i == oven) {
                front(s, {x, 0.12f}, {x + each, 0.7f}, d / 2 - 0.03f, g, m, 0, true, 0);
                front(s, {x, 0.7f}, {x + each, h - 0.045f}, d / 2 - 0.03f, m, m, 0, true, 0);
                s.box({x + 0.03f, h, -d / 2 + 0.08f}, {x + each - 0.03f, h + 0.006f, d / 2 - 0.08f}, g);
              } else if (i % 2) {
                for (int k = 0; k < 3; ++k) {
                  const float y = 0.12f + (h - 0.165f) / 3 * static_cast<float>(k);
                  front(s, {x, y}, {x + each, y + (h - 0.165f) / 3}, d / 2 - 0.03f, b, m, style, true, 0);
                }
              } else {
                front(s, {x, 0.12f}, {x + each, h - 0.045f}, d / 2 - 0.03f, b, m, style, false, 1);
              }
              if (!upper || i == oven) continue;
              s.box({x, 1.5f, -d / 2}, {x + each, 2.15f, -d / 2 + 0.32f}, b);
              front(s, {x, 1.5f}, {x + each, 2.15f}, -d / 2 + 0.32f, b, m, style, false, i % 2 ? 1.f : -1.f);
            }
            const float sink = -width / 2 + each * (static_cast<float>((oven + units / 2) % units) + 0.5f);
            s.box({sink - 0.22f, h, -0.2f}, {sink + 0.22f, h + 0.004f, 0.2f}, m);
            Shapes spout = s.at({sink, h, -0.23f});
            tap(spout, 0.28f, 0.18f, s.material(chrome));
            if (strip) {  // light below the wall units
              const int light = s.emitter({glow, false}), lens = s.material(shade);
              s.quad({-width / 2 + 0.05f, 1.498f, -d / 2 + 0.25f}, {width / 2 - 0.05f, 1.498f, -d / 2 + 0.25f},
                     {width / 2 - 0.05f, 1.498f, -d / 2 + 0.28f}, {-width / 2 + 0.05f, 1.498f, -d / 2 + 0.28f}, lens,
                     light);
            }
            const float hob = -width / 2 + each * (static_cast<float>(oven) + 0.5f);
            if (upper) {  // the hood over it
              s.box({hob - each * 0.48f, 1.5f, -d / 2}, {hob + each * 0.48f, 1.56f, -d / 2 + 0.46f}, m);
              s.box({hob - 0.13f, 1.56f, -d / 2}, {hob + 0.13f, 2.15f, -d / 2 + 0.26f}, m);
            }
            Shapes on = s.at({0, h + 0.006f, 0.05f});
            clutter(on, kit, width * 0.9f, d * 0.5f, 0.4f, things);
          }};
}

Piece tv_stand(const Kit& kit, Random& random) {
  const float w = random.between(1.2f, 1.9f), h = random.between(0.38f, 0.55f), d = 0.42f;
  const Material body = kit.palette->body(), metal = kit.palette->metal(), screen = kit.palette->glass();
  const Material frame = kit.palette->make(MaterialClass::Plastic);
  const float tv = random.between(0.9f, 1.3f);
  const int things = random.whole(0, 3);
  return {"tv_stand", {w, h + tv * 0.62f, d}, [=](Shapes& s) {
            const int b = s.material(body), m = s.material(metal), p = s.material(frame);
            s.box({-w / 2, 0.06f, -d / 2}, {w / 2, h, d / 2 - 0.02f}, b);
            for (int i = 0; i < 3; ++i) {
              const float x = -w / 2 + w / 3 * static_cast<float>(i);
              front(s, {x, 0.07f}, {x + w / 3, h - 0.01f}, d / 2 - 0.02f, b, m, 0, true, 0);
            }
            const float th = tv * 0.5625f;
            s.block({0, h, -0.02f}, {0.4f, 0.015f, 0.2f}, p);
            s.block({0, h, -0.04f}, {0.08f, 0.1f, 0.03f}, p);
            s.box({-tv / 2, h + 0.06f, -0.04f}, {tv / 2, h + 0.06f + th, 0}, p);
            s.box({-tv / 2 + 0.012f, h + 0.072f, 0}, {tv / 2 - 0.012f, h + 0.048f + th, 0.002f}, s.material(screen));
            Shapes on = s.at({w / 2 - 0.12f, h, 0.05f});
            clutter(on, kit, 0.2f, 0.25f, 0.3f, things);
          }};
}

Piece box_stack(const Kit& kit, Random& random) {
  const float w = random.between(0.3f, 0.6f), d = random.between(0.3f, 0.5f);
  const int count = random.whole(1, 4);
  std::vector<Material> faces;
  for (int i = 0; i < count; ++i)
    faces.push_back(random.chance(0.5f) ? kit.palette->make(MaterialClass::Paper) : kit.palette->trinket());
  return {"box_stack", {w + 0.1f, 0.35f * static_cast<float>(count), d + 0.1f}, [=](Shapes& s) {
            float y = 0;
            for (const Material& m : faces) {
              Random& r = s.random();
              const glm::vec3 size(w * r.between(0.6f, 1.f), r.between(0.15f, 0.34f), d * r.between(0.6f, 1.f));
              s.at({r.between(-0.04f, 0.04f), y, r.between(-0.04f, 0.04f)}, r.between(-0.3f, 0.3f))
                  .block({0, 0, 0}, size, s.material(m));
              y += size.y;
            }
          }};
}

Piece metal_rack(const Kit& kit, Random& random) {
  const float w = random.between(0.6f, 1.2f), h = random.between(1.f, 1.9f), d = random.between(0.3f, 0.45f);
  const Material metal = kit.palette->chrome(), board = random.chance(0.5f) ? metal : kit.palette->wood();
  const int shelves = random.whole(3, 5), things = random.whole(1, 4);
  return {"metal_rack", {w, h, d}, [=](Shapes& s) {
            const int m = s.material(metal), b = s.material(board);
            for (const float x : {-1.f, 1.f})
              for (const float z : {-1.f, 1.f}) {
                const glm::vec3 foot(x * (w / 2 - 0.012f), 0, z * (d / 2 - 0.012f));
                s.tube({foot, foot + glm::vec3(0, h, 0)}, 0.011f, m, 8);
              }
            for (int i = 0; i < shelves; ++i) {
              const float y = 0.12f + (h - 0.14f) * static_cast<float>(i) / static_cast<float>(shelves - 1);
              s.box({-w / 2 + 0.024f, y - 0.018f, -d / 2 + 0.012f}, {w / 2 - 0.024f, y, d / 2 - 0.012f}, b);
              if (i + 1 == shelves) continue;
              Shapes on = s.at({0, y, 0});
              const float room = (h - 0.14f) / static_cast<float>(shelves - 1) - 0.04f;
              if (s.random().chance(0.4f)) {  // boxes in a row
                const float each = (w - 0.1f) / 3;
                for (int k = 0; k < 3; ++k) {
                  if (!on.random().chance(0.8f)) continue;
                  const glm::vec3 size(each * 0.9f, room * on.random().between(0.4f, 0.9f), d * 0.7f);
                  const glm::vec3 place(each * static_cast<float>(k - 1), 0, 0);
                  if (kit.palette->is_varied() && on.random().chance(0.6f)) {
                    Shapes one = on.at(place);
                    printed_box(one, kit, size);
                  } else {
                    on.block(place, size, on.material(kit.palette->trinket()));
                  }
                }
              } else {
                clutter(on, kit, w * 0.8f, d * 0.7f, room, things);
              }
            }
          }};
}

Piece fridge(const Kit& kit, Random& random) {
  const float h = random.between(1.4f, 2.f), w = random.between(0.55f, 0.7f), split = random.between(0.3f, 0.6f) * h;
  const Material shell = random.chance(0.6f) ? kit.palette->enamel() : kit.palette->metal(),
                 metal = kit.palette->chrome();
  return {
      "fridge", {w, h, 0.66f}, [=](Shapes& s) {
        const int b = s.material(shell), m = s.material(metal);
        s.box({-w / 2, 0.02f, -0.33f}, {w / 2, h, 0.26f}, b);
        front(s, {-w / 2, 0.03f}, {w / 2, split}, 0.26f, b, m, 2, false, 1);
        front(s, {-w / 2, split}, {w / 2, h}, 0.26f, b, m, 2, false, 1);
        for (int i = s.random().whole(0, 4); i > 0; --i) {  // notes
          const float x = s.random().between(-0.35f, 0.25f) * w, y = s.random().between(split + 0.15f, h - 0.2f);
          s.box({x, y, 0.278f}, {x + 0.08f, y + 0.1f, 0.2795f}, s.material(kit.palette->make(MaterialClass::Paper)));
        }
      }};
}

Piece fireplace(const Kit& kit, Random& random, float height) {
  const float w = random.between(1.2f, 1.7f), d = random.between(0.3f, 0.45f), open = random.between(0.5f, 0.7f);
  const float tall = random.between(0.55f, 0.75f), mantel = random.between(1.05f, 1.25f);
  const Material breast = kit.palette->wall(),
                 frame = random.chance(0.5f) ? kit.palette->wood() : kit.palette->make(MaterialClass::GlossPaint);
  const Material soot = kit.palette->glass(), log = kit.palette->wood();
  const int things = random.whole(2, 5);
  return {"fireplace", {w, height, d + 0.18f}, [=](Shapes& whole) {
            Shapes s = whole.at({0, 0, -0.09f});
            const int b = s.material(breast), f = s.material(frame), dark = s.material(soot);
            s.box({-w / 2, 0, -d / 2}, {-open / 2, height, d / 2}, b),
                s.box({open / 2, 0, -d / 2}, {w / 2, height, d / 2}, b);
            s.box({-open / 2, tall, -d / 2}, {open / 2, height, d / 2}, b);
            s.box({-open / 2, 0, -d / 2}, {open / 2, tall, -d / 2 + 0.05f}, dark);
            s.box({-open / 2, 0, -d / 2 + 0.05f}, {open / 2, 0.03f, d / 2 + 0.15f}, dark);
            for (const float x : {-1.f, 1.f})
              s.box({x * (open / 2 + 0.07f) - 0.07f, 0, d / 2},
                    {x * (open / 2 + 0.07f) + 0.07f, mantel - 0.06f, d / 2 + 0.04f}, f);
            s.box({-open / 2, tall, d / 2}, {open / 2, mantel - 0.06f, d / 2 + 0.03f}, f);
            s.box({-open / 2 - 0.22f, mantel - 0.06f, -d / 2}, {open / 2 + 0.22f, mantel, d / 2 + 0.16f}, f);
            for (int i = 0; i < 3; ++i) {
              const float z = -d / 2 + 0.12f + 0.05f * static_cast<float>(i);
              s.tube({{-open * 0.35f, 0.07f, z}, {open * 0.35f, 0.08f, z + 0.02f}}, 0.035f, s.material(log), 9);
            }
            Shapes on = s.at({0, mantel, d / 2 + 0.07f});
            clutter(on, kit, open + 0.35f, 0.14f, 0.4f, things);
          }};
}

}  // namespace clerestory
