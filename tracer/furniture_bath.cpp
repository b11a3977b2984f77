// Bathrooms: porcelain, taps, a mirror, a washing machine.
#include <algorithm>
#include <cmath>

#include "tracer/furniture.hpp"

namespace clerestory {

void tap(Shapes& s, float height, float reach, int metal) {
  s.cylinder({0, 0, 0}, 0.024f, 0.02f, metal, 12);
  s.tube({{0, 0.015f, 0},
          {0, height * 0.8f, 0},
          {0, height, reach * 0.3f},
          {0, height, reach * 0.75f},
          {0, height - 0.03f, reach}},
         0.012f, metal, 10);
  s.tube({{0.02f, 0.05f, 0}, {0.075f, 0.075f, 0.01f}}, 0.007f, metal, 8);
}

namespace {

/// A round basin with its hollow, `height` above y = 0.
void basin(Shapes& s, float radius, float height, int china) {
  s.lathe({0, 0, 0},
          {{radius * 0.5f, 0},
           {radius * 0.95f, height * 0.7f},
           {radius, height},
           {radius * 0.92f, height},
           {radius * 0.8f, height * 0.5f},
           {radius * 0.2f, height * 0.15f},
           {0, height * 0.12f}},
          china, 28, -1, true);
}

void mirror_above(Shapes& s, const Kit& kit, float width, bool round) {
  const int frame = s.material(kit.palette->chrome()), face = s.material(kit.palette->mirror());
  if (round) {
    Shapes c =
        s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0, 1, 0), glm::vec4(0, -1, 0, 0), glm::vec4(0, 1.5f, 0, 1)));
    const float r = std::min(width * 0.45f, 0.4f);
    c.lathe({0, 0.004f, 0}, {{r + 0.015f, 0}, {r + 0.015f, 0.016f}, {r, 0.016f}}, frame, 36, -1, true);
    c.lathe({0, 0.018f, 0}, {{r, 0}, {0, 0.0001f}}, face, 36, -1, true);
    return;
  }
  s.box({-width / 2, 1.1f, 0.003f}, {width / 2, 1.9f, 0.018f}, frame);
  s.quad({-width / 2 + 0.01f, 1.11f, 0.019f}, {width / 2 - 0.01f, 1.11f, 0.019f}, {width / 2 - 0.01f, 1.89f, 0.019f},
         {-width / 2 + 0.01f, 1.89f, 0.019f}, face);
}

}  // namespace

Piece washstand(const Kit& kit, Random& random) {
  const float w = random.between(0.5f, 1.2f), d = random.between(0.42f, 0.52f), h = random.between(0.78f, 0.86f);
  const Material body = random.chance(0.5f) ? kit.palette->enamel() : kit.palette->body();
  const Material top = random.chance(0.5f) ? body : kit.palette->top(), china = kit.palette->enamel();
  const Material metal = kit.palette->chrome();
  const bool round = random.chance(0.4f), pedestal = w < 0.65f && random.chance(0.5f);
  const int things = random.whole(1, 3);
  return {"washstand", {w, 1.95f, d}, [=](Shapes& s) {
            const int b = s.material(body), c = s.material(china), m = s.material(metal);
            const float radius = std::min(d * 0.42f, w * 0.42f);
            if (pedestal) {
              s.lathe({0, 0, -0.06f}, {{0.12f, 0}, {0.07f, 0.2f}, {0.08f, h - 0.05f}}, c, 20);
              s.box({-radius, h - 0.05f, -d / 2}, {radius, h, -d / 2 + 0.12f}, c);
            } else {
              s.box({-w / 2, 0.2f, -d / 2}, {w / 2, h - 0.03f, d / 2 - 0.02f}, b);
              for (const float x : {-0.25f, 0.25f}) {
                s.box({x * w - w * 0.245f, 0.22f, d / 2 - 0.02f}, {x * w + w * 0.245f, h - 0.05f, d / 2 - 0.004f}, b);
                s.tube({{x * w * 0.2f, h * 0.6f, d / 2 - 0.004f},
                        {x * w * 0.2f, h * 0.6f, d / 2 + 0.02f},
                        {x * w * 0.2f, h * 0.78f, d / 2 + 0.02f},
                        {x * w * 0.2f, h * 0.78f, d / 2 - 0.004f}},
                       0.006f, m, 6);
              }
              s.box({-w / 2, h - 0.03f, -d / 2}, {w / 2, h, d / 2}, s.material(top));
            }
            Shapes bowl = s.at({0, pedestal ? h - 0.1f : h, 0.02f});
            basin(bowl, radius, 0.12f, c);
            Shapes spout = s.at({0, h, -d / 2 + 0.05f});
            tap(spout, 0.2f, 0.12f, m);
            Shapes back = s.at({0, 0, -d / 2});
            mirror_above(back, kit, w * 0.9f, round);
            Shapes on = s.at({w / 2 - 0.12f, h, -d / 2 + 0.14f});
            if (w > 0.9f) clutter(on, kit, 0.22f, 0.2f, 0.25f, things);
          }};
}

Piece toilet(const Kit& kit, Random& random) {
  const Material china = kit.palette->enamel(), metal = kit.palette->chrome();
  const bool hung = random.chance(0.4f);
  return {"toilet", {0.38f, 0.85f, 0.66f}, [=](Shapes& s) {
            const int c = s.material(china), m = s.material(metal);
            s.cushion({-0.18f, hung ? 0.12f : 0.f, -0.2f}, {0.18f, 0.39f, 0.33f}, 0.13f, c, 3);
            s.cushion({-0.185f, 0.38f, -0.17f}, {0.185f, 0.425f, 0.33f}, 0.022f, c, 2);
            if (hung) {
              s.box({-0.12f, 0.95f - 0.12f, -0.33f}, {0.12f, 0.99f - 0.14f, -0.32f}, m);
            } else {
              s.cushion({-0.19f, 0.4f, -0.33f}, {0.19f, 0.8f, -0.17f}, 0.04f, c, 2);
              s.cylinder({0, 0.8f, -0.25f}, 0.025f, 0.012f, m, 14);
            }
          }};
}

Piece bathtub(const Kit& kit, Random& random) {
  const float w = random.between(1.5f, 1.8f), d = random.between(0.7f, 0.8f), h = random.between(0.52f, 0.6f);
  const Material china = kit.palette->enamel(), metal = kit.palette->chrome(),
                 apron = random.chance(0.5f) ? china : kit.palette->make(MaterialClass::Tile);
  return {"bathtub", {w, h + 0.3f, d}, [=](Shapes& s) {
            const int c = s.material(china), a = s.material(apron), m = s.material(metal);
            const float rim = 0.07f, low = 0.12f;
            s.box({-w / 2, 0, -d / 2}, {w / 2, low, d / 2}, a);
            s.box({-w / 2, low, d / 2 - rim}, {w / 2, h, d / 2}, a);
            s.box({-w / 2, low, -d / 2}, {w / 2, h, -d / 2 + rim}, a);
            for (const float x : {-1.f, 1.f})
              s.box({std::min(x * w / 2, x * (w / 2 - rim)), low, -d / 2 + rim},
                    {std::max(x * w / 2, x * (w / 2 - rim)), h, d / 2 - rim}, a);
            // The hollow: a lining that slopes inwards.
            const glm::vec3 o[4] = {{-w / 2 + rim, h, -d / 2 + rim},
                                    {w / 2 - rim, h, -d / 2 + rim},
                                    {w / 2 - rim, h, d / 2 - rim},
                                    {-w / 2 + rim, h, d / 2 - rim}};
            const glm::vec3 i[4] = {{-w / 2 + 0.25f, low + 0.01f, -d / 2 + 0.14f},
                                    {w / 2 - 0.14f, low + 0.01f, -d / 2 + 0.14f},
                                    {w / 2 - 0.14f, low + 0.01f, d / 2 - 0.14f},
                                    {-w / 2 + 0.25f, low + 0.01f, d / 2 - 0.14f}};
            for (int k = 0; k < 4; ++k) s.quad(i[k], i[(k + 1) % 4], o[(k + 1) % 4], o[k], c);
            s.quad(i[3], i[2], i[1], i[0], c);
            s.box({-w / 2, h, -d / 2}, {w / 2, h + 0.012f, -d / 2 + rim}, c),
                s.box({-w / 2, h, d / 2 - rim}, {w / 2, h + 0.012f, d / 2}, c);
            Shapes spout = s.at({w / 2 - 0.35f, h + 0.012f, -d / 2 + 0.035f});
            tap(spout, 0.16f, 0.16f, m);
          }};
}

Piece washing_machine(const Kit& kit, Random& random) {
  const Material shell = kit.palette->enamel(), metal = kit.palette->chrome(), glass = kit.palette->glass();
  const int things = random.whole(0, 3);
  return {"washing_machine", {0.6f, 0.85f, 0.6f}, [=](Shapes& s) {
            const int b = s.material(shell), m = s.material(metal);
            s.box({-0.3f, 0.01f, -0.3f}, {0.3f, 0.85f, 0.28f}, b);
            s.box({-0.28f, 0.74f, 0.28f}, {0.28f, 0.83f, 0.29f}, s.material(glass));
            Shapes c = s.at(glm::mat4(glm::vec4(1, 0, 0, 0), glm::vec4(0, 0, 1, 0), glm::vec4(0, -1, 0, 0),
                                      glm::vec4(0, 0.42f, 0.28f, 1)));
            c.lathe({0, 0, 0}, {{0.19f, 0}, {0.18f, 0.02f}, {0.14f, 0.02f}}, m, 28, -1, true);
            c.lathe({0, 0, 0}, {{0.145f, 0.019f}, {0.08f, 0.005f}, {0, 0.004f}}, s.material(glass), 24, -1, true);
            Shapes on = s.at({0, 0.85f, 0});
            clutter(on, kit, 0.5f, 0.4f, 0.4f, things);
          }};
}

}  // namespace clerestory
