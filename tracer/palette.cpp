#include "tracer/palette.hpp"

#include <algorithm>
#include <cmath>

#include "tracer/material_parts.hpp"

namespace clerestory {
namespace {

/// Share of a wild room's surfaces that are anything.
constexpr float kWildSurfaces = 0.7f;

/// Roughness from lacquered or polished to raw, by class, as far as people's things have it, and how often a thing
/// keeps what its class has most.
struct Finish {
  float least, most, usual;
};
Finish finish_of(MaterialClass kind) {
  switch (kind) {
    case MaterialClass::WallPaint:
      return {0.5f, 0.98f, 0.75f};
    case MaterialClass::GlossPaint:
      return {0.06f, 0.8f, 0.4f};
    case MaterialClass::Wood:
      return {0.1f, 0.85f, 0.4f};
    case MaterialClass::Tile:
    case MaterialClass::Stone:
      return {0.05f, 0.8f, 0.4f};
    case MaterialClass::Fabric:
      return {0.6f, 1, 0.7f};
    case MaterialClass::Leather:
      return {0.2f, 0.75f, 0.4f};
    case MaterialClass::Plastic:
      return {0.07f, 0.8f, 0.3f};
    case MaterialClass::Ceramic:
      return {0.04f, 0.7f, 0.5f};
    case MaterialClass::Metal:
      return {0.05f, 0.65f, 0.4f};
    case MaterialClass::Carpet:
      return {0.85f, 1, 0.7f};
    case MaterialClass::Paper:
      return {0.12f, 0.95f, 0.5f};
    case MaterialClass::Concrete:
      return {0.15f, 0.95f, 0.5f};
  }
  return {0, 1, 1};
}

}  // namespace

const char* name_of(MaterialClass kind) {
  constexpr const char* names[] = {"wall_paint", "gloss_paint", "wood",  "tile",   "stone", "fabric",  "leather",
                                   "plastic",    "ceramic",     "metal", "carpet", "paper", "concrete"};
  return names[static_cast<int>(kind)];
}

Palette::Palette(Random random, Content content) : random_(random), content_(content) {
  for (int i = 0; i < 6; ++i) {
    if (i < 4) woods_.push_back(make(MaterialClass::Wood));
    fabrics_.push_back(i < 4 ? make(MaterialClass::Fabric) : print());
    if (i < 3) metals_.push_back(make(MaterialClass::Metal));
  }
  body_choice_ = random_.unit();
}

glm::vec3 Palette::paint_color() {
  // Most walls are white or nearly so, some pastel, few strong.
  if (random_.chance(0.7f))
    return hsv(random_.between(0.05f, 0.17f), random_.between(0, 0.08f), random_.between(0.81f, 0.91f));
  if (random_.chance(0.8f)) return hsv(random_.unit(), random_.between(0.05f, 0.2f), random_.between(0.6f, 0.88f));
  const glm::vec3 strong = strong_color();
  return strong * 0.7f + glm::vec3(0.1f);
}

glm::vec3 Palette::strong_color() {
  if (is_varied() && random_.chance(0.3f)) return any_color();
  if (random_.chance(0.3f)) return grey(random_.between(0.08f, 0.88f));
  // Reds, ochres, greens and blues are common at home, magenta and cyan are not.
  const float hue = random_.one_of({0.01f, 0.06f, 0.1f, 0.13f, 0.25f, 0.36f, 0.45f, 0.55f, 0.6f, 0.63f, 0.92f});
  return hsv(std::fmod(hue + random_.between(-0.03f, 0.03f) + 1, 1.f), random_.between(0.3f, 0.8f),
             random_.between(0.25f, 0.82f));
}

glm::vec3 Palette::any_color() {
  const float saturation = random_.chance(0.4f) ? random_.between(0, 0.2f) : random_.between(0, 0.95f);
  return hsv(random_.unit(), saturation, random_.between(0.1f, 0.95f));
}

Material Palette::make(MaterialClass kind) {
  if (!is_varied()) return made(kind);
  Material m;
  if (!further(kind, m)) m = made(kind);
  return dressed(lived_with(m, kind));
}

Material Palette::made(MaterialClass kind) {
  switch (kind) {
    case MaterialClass::WallPaint:
      return made_wall_paint();
    case MaterialClass::GlossPaint:
      return made_gloss_paint();
    case MaterialClass::Wood:
      return made_wood();
    case MaterialClass::Tile:
      return made_tile();
    case MaterialClass::Stone:
      return made_stone();
    case MaterialClass::Fabric:
      return made_fabric();
    case MaterialClass::Leather:
      return made_leather();
    case MaterialClass::Plastic:
      return made_plastic();
    case MaterialClass::Ceramic:
      return made_ceramic();
    case MaterialClass::Metal:
      return made_metal();
    case MaterialClass::Carpet:
      return made_carpet();
    case MaterialClass::Paper:
      return made_paper();
    case MaterialClass::Concrete:
      return made_concrete();
  }
  return {};
}

Material Palette::lived_with(Material m, MaterialClass kind) {
  Random& r = random_;
  const Finish finish = finish_of(kind);
  if (!r.chance(finish.usual)) {
    const float shift = r.between(finish.least, finish.most) - m.roughness_a;
    const auto moved = [shift](float rough) { return std::clamp(rough + shift, 0.04f, 1.f); };
    roughness(m, moved(m.roughness_a), moved(m.roughness_b), moved(m.roughness_c));
  }
  cloud(m, 0.3f, 0.3f);
  return m;
}

void Palette::cloud(Material& m, float smudged, float stained) {
  Random& r = random_;
  const float least = std::min(m.roughness_a, std::min(m.roughness_b, m.roughness_c));
  m.smudge = r.chance(smudged) ? std::min(r.between(0.04f, 0.25f), least - 0.03f) * r.one_of({1.f, -1.f}) : 0;
  m.smudge_scale = r.log_between(0.7f, 25);
  m.stain = r.chance(stained) ? r.between(0.03f, 0.22f) : 0;
  m.stain_scale = r.log_between(0.4f, 12);
  // What tint, noise and stain leave of the darkest, planks included.
  const float least_albedo = 0.021f / (1 - std::max(m.tint, 0.25f) - m.noise - m.stain);
  colors(m, glm::max(m.color_a, least_albedo), glm::max(m.color_b, least_albedo), glm::max(m.color_c, least_albedo));
}

Material Palette::dressed(const Material& m) { return is_wild() && random_.chance(kWildSurfaces) ? anything() : m; }

Material Palette::patterned(std::initializer_list<int> patterns, float least, float most) {
  Random& r = random_;
  Material m = textured(Texture::Print, r);
  m.pattern = static_cast<float>(r.one_of(patterns));
  const glm::vec3 ground = r.chance(0.45f) ? paint_color() : strong_color();
  const glm::vec3 figure = r.chance(0.35f) ? ground * r.between(0.35f, 0.8f) : strong_color();
  colors(m, ground, figure, r.chance(0.5f) ? strong_color() : ground * r.between(0.3f, 0.9f));
  m.scale = glm::vec3(r.log_between(least, most));
  if (r.chance(0.4f)) m.scale.y *= r.between(0.5f, 2);
  if (static_cast<int>(m.pattern) == Text) m.scale.y *= 1.6f;
  m.gap = static_cast<int>(m.pattern) == Mosaic ? r.between(0, 0.1f) : r.between(0.03f, 0.3f);
  m.warp = r.between(0.2f, 2.5f);
  m.tint = r.chance(0.4f) ? r.between(0, 0.08f) : 0;
  return m;
}

Material Palette::any_texture() {
  Random& r = random_;
  const float kind = r.unit();
  if (kind < 0.25f) {  // nearly flat
    Material m = textured(Texture::Plain, r);
    m.scale = glm::vec3(r.log_between(0.5f, 20));
    return m;
  }
  if (kind < 0.7f) {
    Material m = patterned({0}, 0.5f, 40);
    m.pattern = static_cast<float>(r.whole(0, kPrints - 1));
    return m;
  }
  const Texture other =
      r.one_of({Texture::Plaster, Texture::Fabric, Texture::Wood, Texture::Tiles, Texture::Metal, Texture::Leather});
  Material m = textured(other, r);
  m.scale = glm::vec3(r.log_between(1, 40), r.log_between(1, 40), r.log_between(1, 40));
  if (other == Texture::Wood) m.scale.x = m.scale.y = 0, m.scale.z = r.log_between(4, 60);
  if (other == Texture::Metal) m.scale = {3, r.log_between(20, 200), r.log_between(20, 200)};
  if (other == Texture::Tiles) m.gap = r.between(0.005f, 0.06f), m.tint = r.between(0, 0.3f);
  m.pattern = static_cast<float>(r.whole(0, 2));
  m.warp = r.between(0.3f, 3), m.wear = r.chance(0.4f) ? r.between(0.2f, 0.6f) : 0;
  return m;
}

Material Palette::anything() {
  Random& r = random_;
  Material m = any_texture();
  const glm::vec3 c = any_color();
  const bool alike = m.texture == static_cast<float>(Texture::Plain) || r.chance(0.4f);
  colors(m, c, alike ? c * r.between(0.6f, 1.2f) : any_color(), alike ? c * r.between(0.5f, 1.3f) : any_color());
  const float rough = r.between(0.05f, 1);
  if (r.chance(0.5f))
    roughness(m, rough, rough, rough);  // albedo varies where the material does not
  else
    roughness(m, rough, r.between(0.05f, 1), r.between(0.05f, 1));
  const float metal = r.unit();
  if (metal < 0.1f) m.metallic_a = m.metallic_b = m.metallic_c = 1;
  if (metal > 0.93f) m.metallic_b = r.chance(0.5f) ? 1.f : 0.f, m.metallic_c = 1 - m.metallic_b;
  m.noise = r.chance(0.3f) ? r.between(0, 0.15f) : 0;
  cloud(m, 0.5f, 0.4f);
  return m;
}

}  // namespace clerestory
