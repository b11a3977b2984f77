#include "tracer/palette.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {
namespace {

/// Linear colour from hue in turns, saturation and value, all of the gamma-encoded colour.
glm::vec3 hsv(float hue, float saturation, float value) {
  glm::vec3 rgb;
  for (int c = 0; c < 3; ++c) {
    const float k = std::fmod(hue * 6 + (c == 0 ? 5.f : c == 1 ? 3.f : 1.f), 6.f);
    const float v = value - value * saturation * std::clamp(std::min(k, 4.f - k), 0.f, 1.f);
    rgb[c] = std::pow(v, 2.2f);
  }
  return rgb;
}

glm::vec3 grey(float value) { return glm::vec3(std::pow(value, 2.2f)); }

Material base(Texture texture, Random& random) {
  Material m;
  m.texture = static_cast<float>(texture);
  m.seed = static_cast<float>(random.whole(0, 4095));
  return m;
}

/// Share of a wild room's surfaces that are anything.
constexpr float kWildSurfaces = 0.7f;
/// Patterns of Texture::Print (kernels/trace/texture.clh).
constexpr int kPrints = 13;
enum Print { Stripes, Tartan, Dots, Damask, Flowers, Zigzag, Rings, Patches, Text, Blocks, Mosaic, Basket, Clouds };

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

/// Nothing at home is blacker: with a texture's tint the albedo stays above 0.02.
constexpr float kDarkest = 0.028f;

void colors(Material& m, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  m.color_a = glm::max(a, kDarkest), m.color_b = glm::max(b, kDarkest), m.color_c = glm::max(c, kDarkest);
}

void roughness(Material& m, float a, float b, float c) { m.roughness_a = a, m.roughness_b = b, m.roughness_c = c; }

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

Material Palette::make(MaterialClass kind) {
  if (!is_varied()) return made(kind);
  Material m;
  if (!further(kind, m)) m = made(kind);
  return dressed(lived_with(m, kind));
}

Material Palette::made(MaterialClass kind) {
  Random& r = random_;
  switch (kind) {
    case MaterialClass::WallPaint: {
      Material m = base(Texture::Plaster, r);
      const glm::vec3 c = paint_color();
      colors(m, c * 0.97f, c * 1.02f, c * 0.85f);
      // Emulsion is matt; a few walls are satin (kitchens, halls), hardly any polished plaster.
      const float kind_of = r.unit();
      const float rough = kind_of < 0.91f   ? r.between(0.75f, 0.95f)
                          : kind_of < 0.98f ? r.between(0.4f, 0.62f)
                                            : r.between(0.12f, 0.3f);
      roughness(m, rough, rough + 0.03f, std::min(rough + 0.05f, 1.f));
      m.scale = glm::vec3(r.between(0.8f, 3.f));
      m.noise = r.between(0, 0.03f);
      m.wear = r.chance(0.3f) ? r.between(0.2f, 0.4f) : 0;
      return m;
    }
    case MaterialClass::GlossPaint: {
      Material m = base(Texture::Plain, r);
      const glm::vec3 c =
          r.chance(0.75f) ? hsv(r.between(0, 0.2f), r.between(0, 0.12f), r.between(0.74f, 0.9f)) : strong_color();
      colors(m, c, c * 0.98f, c * 0.9f);
      // Furniture and doors are satin more often than glossy.
      const float rough = r.chance(0.65f) ? r.between(0.32f, 0.6f) : r.between(0.1f, 0.32f);
      roughness(m, rough, rough + 0.04f, rough + 0.25f);
      m.scale = glm::vec3(r.between(1.f, 4.f));
      m.wear = r.chance(0.4f) ? r.between(0.2f, 0.45f) : 0;
      return m;
    }
    case MaterialClass::Wood:
      return made_wood();
    case MaterialClass::Tile: {
      Material m = base(Texture::Tiles, r);
      const glm::vec3 c =
          r.chance(0.6f) ? hsv(r.between(0.05f, 0.15f), r.between(0, 0.25f), r.between(0.6f, 0.9f)) : strong_color();
      const glm::vec3 other = r.chance(0.4f) ? strong_color() : c * r.between(0.7f, 0.95f);
      colors(m, c, other, grey(r.between(0.3f, 0.75f)));
      const bool matt = r.chance(0.4f);  // unglazed
      const float rough = matt ? r.between(0.38f, 0.65f) : r.between(0.06f, 0.26f);
      roughness(m, rough, rough + r.between(0.02f, 0.1f), 0.9f);
      const float size = r.one_of({0.1f, 0.15f, 0.2f, 0.3f, 0.4f, 0.6f, 0.9f});
      m.scale = {1 / size, r.one_of({1.f, 1.f, 1.f, 2.f, 3.f}) / size, 1};
      m.gap = std::clamp(r.between(0.0025f, 0.004f) / size, 0.006f, 0.03f);
      m.tint = r.between(0.01f, 0.07f);
      m.warp = r.between(0.5f, 2.f);
      m.pattern = static_cast<float>(r.one_of({0, 0, 1, 2}));
      return m;
    }
    case MaterialClass::Stone: {
      if (!stone_only()) return made(r.chance(0.5f) ? MaterialClass::Tile : MaterialClass::Concrete);
      Material m = base(Texture::Stone, r);
      m.pattern = static_cast<float>(r.whole(0, 1));
      const glm::vec3 c = r.chance(0.55f) ? hsv(r.between(0.05f, 0.2f), r.between(0, 0.12f), r.between(0.72f, 0.88f))
                                          : hsv(r.unit(), r.between(0.05f, 0.35f), r.between(0.15f, 0.5f));
      colors(m, c, c * r.between(0.6f, 0.85f), c.x > 0.3f ? c * r.between(0.2f, 0.5f) : grey(r.between(0.6f, 0.85f)));
      const float rough = r.chance(0.6f) ? r.between(0.06f, 0.2f) : r.between(0.3f, 0.5f);
      roughness(m, rough, rough + 0.05f, rough + 0.2f);
      m.scale = glm::vec3(r.between(0.8f, 2.5f) * (m.pattern > 0 ? 6.f : 1.f));
      m.warp = r.between(0.5f, 2.5f);
      return m;
    }
    case MaterialClass::Fabric: {
      Material m = base(Texture::Fabric, r);
      const glm::vec3 c = r.chance(0.45f) ? hsv(r.between(0.04f, 0.16f), r.between(0.02f, 0.3f), r.between(0.3f, 0.85f))
                                          : strong_color();
      m.pattern = static_cast<float>(r.one_of({0, 0, 0, 1, 2}));
      const glm::vec3 other = m.pattern > 0 ? (r.chance(0.4f) ? strong_color() : c * 0.4f) : c * r.between(0.65f, 0.9f);
      colors(m, c, other, c);
      const float rough = r.between(0.86f, 0.96f);
      roughness(m, rough, std::min(rough + 0.04f, 1.f), 1);
      const float cells = m.pattern > 0 ? r.between(6.f, 20.f) : r.between(4.f, 14.f);
      m.scale = glm::vec3(cells);
      m.tint = r.between(0.03f, 0.12f);
      return m;
    }
    case MaterialClass::Leather: {
      Material m = base(Texture::Leather, r);
      const glm::vec3 c = r.chance(0.7f) ? hsv(r.between(0.02f, 0.08f), r.between(0.3f, 0.75f), r.between(0.12f, 0.55f))
                                         : strong_color() * 0.6f;
      colors(m, c * 0.6f, c, c * 1.25f);
      const float rough = r.between(0.3f, 0.45f);
      roughness(m, rough + 0.25f, rough, rough + 0.15f);
      m.scale = glm::vec3(r.between(50.f, 110.f));
      m.wear = r.between(0, 0.4f);
      return m;
    }
    case MaterialClass::Plastic: {
      Material m = base(Texture::Plain, r);
      const glm::vec3 c = r.chance(0.4f) ? grey(r.one_of({0.12f, 0.25f, 0.5f, 0.85f})) : strong_color();
      colors(m, c, c * 0.97f, c * 0.9f);
      const float rough = r.between(0.22f, 0.52f);
      roughness(m, rough, rough + 0.03f, rough + 0.15f);
      m.scale = glm::vec3(3);
      m.wear = r.chance(0.3f) ? 0.3f : 0;
      return m;
    }
    case MaterialClass::Ceramic: {
      Material m = base(Texture::Plain, r);
      const glm::vec3 c = r.chance(0.5f) ? hsv(0.12f, r.between(0, 0.1f), r.between(0.8f, 0.9f)) : strong_color();
      colors(m, c, c * 0.96f, c);
      const float rough = r.between(0.05f, 0.16f);
      roughness(m, rough, rough + 0.02f, rough);
      m.scale = glm::vec3(8);
      return m;
    }
    case MaterialClass::Metal: {
      Material m = base(Texture::Metal, r);
      const float kind_of = r.unit();
      const glm::vec3 c = kind_of < 0.55f  ? glm::vec3(r.between(0.5f, 0.65f)) * glm::vec3(1.0f, 0.99f, 0.97f)
                          : kind_of < 0.7f ? glm::vec3(0.86f, 0.62f, 0.3f)    // brass
                          : kind_of < 0.8f ? glm::vec3(0.85f, 0.5f, 0.36f)    // copper
                          : kind_of < 0.9f ? glm::vec3(0.88f, 0.88f, 0.87f)   // aluminium
                                           : glm::vec3(0.16f, 0.15f, 0.15f);  // blackened steel
      colors(m, c, c * 0.92f, c * 0.7f);
      const bool brushed = r.chance(0.6f);
      const float rough = brushed ? r.between(0.22f, 0.42f) : r.between(0.06f, 0.16f);
      roughness(m, rough, rough + (brushed ? 0.1f : 0.02f), std::min(rough + 0.3f, 0.6f));
      m.metallic_a = m.metallic_b = m.metallic_c = 1;
      m.scale = {3, 180, 180};
      m.wear = r.chance(0.4f) ? r.between(0.3f, 0.5f) : 0;
      return m;
    }
    case MaterialClass::Carpet: {
      Material m = base(Texture::Fabric, r);
      const glm::vec3 c = r.chance(0.6f) ? hsv(r.between(0.04f, 0.14f), r.between(0.03f, 0.3f), r.between(0.35f, 0.78f))
                                         : strong_color();
      colors(m, c, c * r.between(0.75f, 0.95f), c);
      roughness(m, 0.96f, 1, 1);
      m.scale = glm::vec3(r.between(3.f, 12.f));
      m.tint = 0.1f;
      m.noise = r.between(0.03f, 0.12f);
      return m;
    }
    case MaterialClass::Paper: {
      Material m = base(Texture::Plain, r);
      const glm::vec3 c = strong_color();
      colors(m, c, c * 0.95f, c * 0.8f);
      const float rough = r.between(0.6f, 0.9f);
      roughness(m, rough, rough, rough);
      m.scale = glm::vec3(6);
      return m;
    }
    case MaterialClass::Concrete: {
      Material m = base(Texture::Plaster, r);
      const glm::vec3 c = hsv(r.between(0.05f, 0.15f), r.between(0, 0.1f), r.between(0.4f, 0.7f));
      colors(m, c * 0.8f, c * 1.1f, c * 0.6f);
      const bool polished = r.chance(0.25f);
      const float rough = polished ? r.between(0.1f, 0.3f) : r.between(0.6f, 0.8f);
      // Dark patches are polished by feet.
      roughness(m, rough, rough + (polished ? 0.05f : 0.15f), polished ? rough * 0.8f : rough - 0.2f);
      m.scale = glm::vec3(r.between(1.f, 3.f));
      m.noise = polished ? 0 : r.between(0.05f, 0.15f);
      m.wear = r.between(0.3f, 0.5f);
      return m;
    }
  }
  return {};
}

Material Palette::made_wood() {
  struct Kind {
    float hue0, hue1, saturation0, saturation1, value0, value1,
        grain;  // grain: darkest part of a ring over the light
  };
  // Pine, birch, oak, beech, teak, cherry, walnut, wenge, limed and grey.
  constexpr Kind kinds[] = {
      {0.09f, 0.11f, 0.35f, 0.55f, 0.76f, 0.88f, 0.7f},  {0.09f, 0.115f, 0.18f, 0.32f, 0.8f, 0.9f, 0.85f},
      {0.08f, 0.105f, 0.4f, 0.58f, 0.55f, 0.75f, 0.6f},  {0.065f, 0.085f, 0.35f, 0.5f, 0.65f, 0.8f, 0.8f},
      {0.06f, 0.085f, 0.5f, 0.68f, 0.45f, 0.6f, 0.6f},   {0.03f, 0.055f, 0.5f, 0.72f, 0.38f, 0.58f, 0.65f},
      {0.05f, 0.075f, 0.42f, 0.6f, 0.28f, 0.45f, 0.55f}, {0.04f, 0.07f, 0.3f, 0.5f, 0.2f, 0.28f, 0.7f},
      {0.09f, 0.12f, 0.08f, 0.2f, 0.78f, 0.9f, 0.8f},    {0.07f, 0.11f, 0.06f, 0.18f, 0.42f, 0.65f, 0.6f},
  };
  Random& r = random_;
  Material m = base(Texture::Wood, r);
  const Kind& kind = kinds[r.whole(0, 9)];
  const glm::vec3 light = hsv(r.between(kind.hue0, kind.hue1), r.between(kind.saturation0, kind.saturation1),
                              r.between(kind.value0, kind.value1));
  const bool varnished = r.chance(0.4f);  // varnish deepens the colour and makes it shine
  const float deep = varnished ? 0.85f : 1.f;
  colors(m, light * deep, light * (deep * kind.grain * r.between(0.85f, 1.1f)), light * 0.15f);
  const float rough = varnished ? r.between(0.16f, 0.42f) : r.between(0.48f, 0.74f);
  roughness(m, rough, rough + (varnished ? 0.05f : 0.14f), 0.9f);
  m.scale = {0, 0, r.between(9.f, 30.f)};
  m.warp = r.between(0.8f, 3.f);
  m.noise = varnished ? 0 : r.between(0, 0.05f);
  return m;
}

Material Palette::wood() { return stone_only() ? make(MaterialClass::Stone) : random_.one_of(woods_); }
Material Palette::fabric() { return random_.one_of(fabrics_); }
Material Palette::metal() { return random_.one_of(metals_); }

Material Palette::body() {
  if (stone_only()) return make(MaterialClass::Stone);
  if (body_choice_ < 0.45f) return woods_[0];
  if (body_choice_ < 0.75f) return make(MaterialClass::GlossPaint);
  if (body_choice_ < 0.87f) return metals_[0];  // steel fronts: metal is not only what is thin
  return make(MaterialClass::Plastic);
}

Material Palette::top() {
  if (stone_only() || random_.chance(0.2f)) return make(MaterialClass::Stone);
  const float choice = random_.unit();
  if (choice < 0.7f) return random_.one_of(woods_);
  return choice < 0.92f ? make(MaterialClass::GlossPaint) : metals_[0];
}

Material Palette::planks(const Material& wood) {
  Material m = wood;
  const bool parquet = random_.chance(0.2f);
  const float width = parquet ? random_.between(0.05f, 0.09f) : random_.between(0.07f, 0.24f);
  m.scale.x = 1 / (parquet ? random_.between(0.25f, 0.5f) : random_.between(0.7f, 2.2f));
  m.scale.y = 1 / width;
  m.gap = std::clamp(0.0018f / width, 0.006f, 0.03f);
  m.tint = random_.between(0.05f, 0.2f);
  return m;
}

Material Palette::floor() {
  if (stone_only()) {
    Material m = make(MaterialClass::Stone);
    m.gap = random_.one_of({0.4f, 0.6f, 0.8f});
    m.tint = 0.06f;
    return m;
  }
  if (is_varied() && random_.chance(0.22f)) return vinyl();
  const float choice = random_.unit();
  if (choice < 0.46f) return planks(make(MaterialClass::Wood));
  if (choice < 0.62f) return make(MaterialClass::Tile);
  if (choice < 0.82f) return make(MaterialClass::Carpet);
  if (choice < 0.91f) return make(MaterialClass::Concrete);
  return make(MaterialClass::Stone);
}

Material Palette::vinyl() {
  Random& r = random_;
  Material m = r.chance(0.5f) ? base(Texture::Plaster, r) : patterned({Clouds, Mosaic, Patches}, 1.5f, 30);
  const glm::vec3 c = r.chance(0.7f) ? hsv(r.unit(), r.between(0, 0.2f), r.between(0.3f, 0.8f)) : any_color();
  colors(m, c, c * r.between(0.75f, 1.2f), c * r.between(0.7f, 1.1f));
  if (m.texture == static_cast<float>(Texture::Plaster)) m.scale = glm::vec3(r.log_between(2, 60));
  const float rough = r.between(0.12f, 0.6f);
  roughness(m, rough, rough + 0.03f, rough + 0.05f);
  cloud(m, 0.6f, 0.4f);
  return dressed(m);
}

Material Palette::wall() {
  if (stone_only() && random_.chance(0.5f)) {
    Material m = make(MaterialClass::Stone);
    m.gap = random_.one_of({0.6f, 1.2f});
    return m;
  }
  const float choice = random_.unit();
  if (choice < 0.76f) return make(MaterialClass::WallPaint);
  if (choice < 0.92f) return wallpaper();
  if (choice < 0.95f) return brick();
  if (choice < 0.98f) return make(MaterialClass::Concrete);
  return planks(make(MaterialClass::Wood));
}

Material Palette::wallpaper() {
  Random& r = random_;
  if (is_varied() && r.chance(0.7f)) {
    Material m = patterned(
        {Stripes, Stripes, Tartan, Dots, Damask, Damask, Flowers, Flowers, Zigzag, Rings, Blocks, Mosaic, Clouds}, 1.2f,
        14);
    const glm::vec3 ground = paint_color();
    const glm::vec3 figure =
        r.chance(0.7f) ? ground * r.between(0.6f, 0.95f) : ground * 0.4f + strong_color() * r.between(0.3f, 0.6f);
    colors(m, ground, figure, r.chance(0.4f) ? ground : r.chance(0.7f) ? figure * 0.7f : strong_color());
    const float rough = r.between(0.55f, 0.95f);
    roughness(m, rough, std::min(rough + 0.05f, 1.f), r.chance(0.85f) ? rough : r.between(0.2f, 0.4f));
    if (r.chance(0.05f)) m.metallic_c = 1;  // gold leaf
    cloud(m, 0.2f, 0.3f);
    return dressed(m);
  }
  const float kind = r.unit();
  Material m = base(kind < 0.35f ? Texture::Fabric : kind < 0.8f ? Texture::Rug : Texture::Painting, r);
  const glm::vec3 ground = paint_color();
  const glm::vec3 figure =
      r.chance(0.7f) ? ground * r.between(0.7f, 0.93f) : ground * 0.5f + strong_color() * r.between(0.2f, 0.5f);
  colors(m, ground, figure, r.chance(0.5f) ? ground : figure * r.between(0.6f, 1.2f));
  const float rough = r.between(0.65f, 0.95f);
  roughness(m, rough, std::min(rough + 0.04f, 1.f), rough);
  if (kind < 0.35f) {
    m.pattern = static_cast<float>(r.one_of({1, 1, 2}));
    m.scale = {r.between(3.f, 12.f), m.pattern > 1 ? r.between(3.f, 12.f) : 3.f, 1};
    m.tint = 0.02f;
  } else if (kind < 0.8f) {
    m.pattern = static_cast<float>(r.one_of({0, 0, 1}));
    m.scale = {r.between(2.f, 7.f), r.between(2.f, 7.f), 1};
    m.tint = r.between(0, 0.05f);
  } else {
    m.scale = glm::vec3(r.between(1.5f, 5.f)), m.warp = r.between(0.5f, 2.f), m.pattern = 0;
  }
  return dressed(m);
}

Material Palette::brick() {
  Material m = base(Texture::Tiles, random_);
  const bool painted = random_.chance(0.35f);
  const glm::vec3 c =
      painted ? paint_color()
              : hsv(random_.between(0.01f, 0.06f), random_.between(0.35f, 0.6f), random_.between(0.5f, 0.72f));
  colors(m, c, c * random_.between(0.65f, 0.9f), painted ? c * 0.8f : grey(random_.between(0.55f, 0.75f)));
  roughness(m, 0.85f, 0.95f, 0.97f);
  m.scale = {1 / 0.25f, 1 / 0.075f, 1};
  m.gap = 0.02f, m.tint = painted ? 0.03f : random_.between(0.1f, 0.2f), m.warp = 2, m.pattern = 1;
  return dressed(m);
}

Material Palette::ceiling() {
  Material m = made(MaterialClass::WallPaint);
  const glm::vec3 white = hsv(0.12f, random_.between(0, 0.05f), random_.between(0.84f, 0.9f));
  colors(m, white, white * 1.02f, white * 0.95f);
  const float rough = random_.between(0.8f, 0.95f);
  roughness(m, rough, rough + 0.03f, std::min(rough + 0.05f, 1.f));
  return dressed(m);
}

Material Palette::rug() {
  if (is_varied() && random_.chance(0.55f)) {
    Material m =
        patterned({Stripes, Tartan, Dots, Damask, Flowers, Zigzag, Rings, Patches, Blocks, Mosaic, Clouds}, 1, 7);
    const float rough = random_.between(0.85f, 0.98f);
    roughness(m, rough, std::min(rough + 0.03f, 1.f), 1);
    m.tint = random_.between(0.05f, 0.2f);
    return dressed(m);
  }
  Material m = base(Texture::Rug, random_);
  colors(m, strong_color(), strong_color(), strong_color());
  roughness(m, 0.96f, 0.98f, 1);
  m.scale = {static_cast<float>(random_.whole(2, 7)), static_cast<float>(random_.whole(2, 7)), 1};
  m.tint = 0.12f;
  m.pattern = static_cast<float>(random_.whole(0, 2));
  return dressed(m);
}

Material Palette::painting() {
  if (is_varied() && random_.chance(0.55f)) {
    Material m =
        patterned({Stripes, Dots, Flowers, Rings, Patches, Text, Text, Blocks, Mosaic, Clouds, Clouds}, 0.7f, 9);
    const float rough = random_.chance(0.4f) ? random_.between(0.08f, 0.3f) : random_.between(0.4f, 0.9f);
    roughness(m, rough, rough, rough);
    return dressed(m);
  }
  Material m = base(Texture::Painting, random_);
  colors(m, strong_color(), strong_color(), strong_color());
  const float rough = random_.chance(0.4f) ? random_.between(0.1f, 0.25f) : random_.between(0.5f, 0.85f);
  roughness(m, rough, rough, rough);
  m.scale = glm::vec3(random_.between(1.f, 3.5f));
  m.warp = random_.between(0.5f, 3.f);
  m.tint = random_.between(0, 0.15f);
  m.pattern = static_cast<float>(random_.whole(0, 2));
  return dressed(m);
}

Material Palette::print() {
  Random& r = random_;
  if (is_varied() && r.chance(0.6f)) {
    Material m = patterned({Stripes, Stripes, Tartan, Tartan, Dots, Damask, Flowers, Flowers, Zigzag, Rings, Patches,
                            Blocks, Mosaic, Clouds},
                           3, 25);
    const float rough = r.between(0.75f, 0.98f);
    roughness(m, rough, std::min(rough + 0.04f, 1.f), rough);
    m.tint = r.between(0, 0.15f);
    return dressed(m);
  }
  const bool motif = r.chance(0.6f);
  Material m = base(motif ? Texture::Rug : Texture::Painting, r);
  const glm::vec3 ground = r.chance(0.5f) ? paint_color() : strong_color();
  colors(m, ground, strong_color(), r.chance(0.5f) ? strong_color() : ground * 0.6f);
  const float rough = r.between(0.84f, 0.96f);
  roughness(m, rough, std::min(rough + 0.04f, 1.f), 1);
  m.scale = glm::vec3(motif ? r.between(3.f, 14.f) : r.between(3.f, 9.f));
  m.warp = r.between(0.5f, 2.f), m.tint = motif ? r.between(0.03f, 0.12f) : 0.05f;
  m.pattern = static_cast<float>(motif ? r.whole(0, 1) : 0);
  return dressed(m);
}

Material Palette::chrome() {
  Material m = base(Texture::Metal, random_);
  const glm::vec3 c = random_.chance(0.75f)  ? glm::vec3(random_.between(0.55f, 0.7f))
                      : random_.chance(0.5f) ? glm::vec3(0.1f)
                                             : glm::vec3(0.8f, 0.6f, 0.32f);
  colors(m, c, c * 0.96f, c * 0.8f);
  const float rough = c.x < 0.2f ? random_.between(0.3f, 0.5f) : random_.between(0.05f, 0.22f);
  roughness(m, rough, rough + 0.03f, rough + 0.2f);
  m.metallic_a = m.metallic_b = m.metallic_c = 1;
  m.scale = {3, 120, 120};
  return dressed(m);
}

Material Palette::leaf() {
  Material m = base(Texture::Plain, random_);
  const glm::vec3 c(random_.between(0.035f, 0.09f), random_.between(0.1f, 0.27f), random_.between(0.03f, 0.07f));
  colors(m, c, c * 0.75f, c);
  const float rough = random_.between(0.35f, 0.6f);
  roughness(m, rough, rough + 0.1f, rough);
  m.scale = glm::vec3(6);
  return dressed(m);
}

Material Palette::enamel() {
  Material m = base(Texture::Plain, random_);
  const glm::vec3 c = random_.chance(0.85f) ? hsv(0.12f, random_.between(0, 0.04f), random_.between(0.86f, 0.91f))
                                            : grey(random_.one_of({0.2f, 0.4f, 0.65f}));
  colors(m, c, c * 0.98f, c);
  const float rough = random_.between(0.06f, 0.22f);
  roughness(m, rough, rough + 0.02f, rough);
  return dressed(m);
}

Material Palette::mirror() {
  Material m = base(Texture::Plain, random_);
  colors(m, glm::vec3(0.88f), glm::vec3(0.88f), glm::vec3(0.88f));
  roughness(m, 0.03f, 0.03f, 0.03f);
  m.metallic_a = m.metallic_b = m.metallic_c = 1;
  return dressed(m);
}

Material Palette::glass() {
  Material m = base(Texture::Plain, random_);
  const glm::vec3 c = grey(random_.between(0.19f, 0.26f));
  colors(m, c, c, c);
  const float rough = random_.between(0.04f, 0.12f);
  roughness(m, rough, rough, rough);
  return dressed(m);
}

Material Palette::diffuser() {
  Material m = base(Texture::Plain, random_);
  colors(m, grey(0.88f), grey(0.88f), grey(0.88f));
  roughness(m, 0.5f, 0.5f, 0.5f);
  return m;
}

Material Palette::patterned(std::initializer_list<int> patterns, float least, float most) {
  Random& r = random_;
  Material m = base(Texture::Print, r);
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

bool Palette::further(MaterialClass kind, Material& m) {
  Random& r = random_;
  const auto is = [&](float share) { return r.chance(share); };
  switch (kind) {
    case MaterialClass::Fabric:
      if (!is(0.25f)) return false;
      m = patterned({Stripes, Stripes, Tartan, Dots, Flowers, Zigzag, Rings, Basket, Mosaic, Clouds}, 4, 30);
      roughness(m, 0.88f, 0.92f, 0.88f);
      m.tint = r.between(0.02f, 0.15f);
      return true;
    case MaterialClass::Paper:
      if (!is(0.5f)) return false;
      m = label();
      return true;
    case MaterialClass::Carpet:
      if (!is(0.35f)) return false;
      m = patterned({Patches, Patches, Stripes, Clouds, Mosaic}, 1.2f, 4);
      m.color_b = m.color_a * r.between(0.7f, 1), m.color_c = m.color_a * r.between(0.6f, 0.9f);
      roughness(m, 0.95f, 0.97f, 0.95f);
      m.tint = r.between(0.1f, 0.25f);
      return true;
    case MaterialClass::Wood: {
      if (!is(0.2f)) return false;
      const bool chips = is(0.5f);  // chipboard, or fibreboard and cork
      m = patterned({chips ? Mosaic : Clouds}, 25, 90);
      const glm::vec3 c = hsv(r.between(0.07f, 0.11f), r.between(0.3f, 0.6f), r.between(0.45f, 0.85f));
      colors(m, c, c * r.between(0.55f, 0.85f), c * r.between(0.5f, 0.9f));
      m.gap = chips ? 0 : 0.2f;
      roughness(m, 0.6f, 0.65f, 0.7f);
      return true;
    }
    case MaterialClass::Tile: {
      if (!is(0.25f)) return false;
      const float size = r.one_of({0.1f, 0.15f, 0.2f, 0.3f});
      m = patterned({Dots, Damask, Flowers, Zigzag, Rings, Blocks, Patches}, 1 / size, 1 / size);
      const float rough = r.between(0.08f, 0.3f);
      roughness(m, rough, rough, rough + 0.05f);
      return true;
    }
    case MaterialClass::Ceramic:
      if (!is(0.25f)) return false;
      m = patterned({Stripes, Dots, Flowers, Rings, Clouds}, 8, 40);
      roughness(m, 0.1f, 0.1f, 0.12f);
      return true;
    case MaterialClass::Plastic:
      if (!is(0.12f)) return false;
      m = patterned({Stripes, Dots, Blocks, Clouds, Text}, 6, 40);
      roughness(m, 0.3f, 0.3f, 0.3f);
      return true;
    case MaterialClass::Metal: {
      const float look = r.unit();
      if (look > 0.35f) return false;
      m = made(MaterialClass::Metal);
      if (look < 0.18f) {  // powder-coated, which is paint
        m = made(MaterialClass::GlossPaint);
      } else if (look < 0.25f) {  // anodised
        const glm::vec3 c = strong_color() * 0.8f + glm::vec3(0.1f);
        colors(m, c, c * 0.95f, c * 0.7f);
      } else {  // rusted, or with paint that comes off
        const bool rust = is(0.5f);
        const glm::vec3 off =
            rust ? hsv(r.between(0.03f, 0.07f), r.between(0.5f, 0.8f), r.between(0.25f, 0.5f)) : any_color();
        m.texture = static_cast<float>(Texture::Print), m.pattern = Clouds;
        m.scale = glm::vec3(r.log_between(2, 15)), m.gap = r.between(0.03f, 0.1f), m.warp = r.between(0.5f, 2);
        colors(m, m.color_a, m.color_b, off);
        const float rough = rust ? r.between(0.7f, 0.95f) : r.between(0.3f, 0.6f);
        m.roughness_c = rough, m.metallic_c = 0;
      }
      return true;
    }
    default:
      return false;
  }
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

Material Palette::dressed(const Material& m) { return is_wild() && random_.chance(kWildSurfaces) ? anything() : m; }

glm::vec3 Palette::any_color() {
  const float saturation = random_.chance(0.4f) ? random_.between(0, 0.2f) : random_.between(0, 0.95f);
  return hsv(random_.unit(), saturation, random_.between(0.1f, 0.95f));
}

Material Palette::any_texture() {
  Random& r = random_;
  const float kind = r.unit();
  if (kind < 0.25f) {  // nearly flat
    Material m = base(Texture::Plain, r);
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
  Material m = base(other, r);
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

Material Palette::label() {
  Random& r = random_;
  Material m = patterned({Stripes, Dots, Flowers, Rings, Patches, Text, Text, Text, Blocks, Blocks, Clouds}, 8, 60);
  const float rough = r.chance(0.5f) ? r.between(0.1f, 0.4f) : r.between(0.5f, 0.9f);
  roughness(m, rough, rough, rough);
  return dressed(m);
}

Material Palette::cardboard() {
  Random& r = random_;
  Material m = base(Texture::Plaster, r);
  const glm::vec3 c = hsv(r.between(0.07f, 0.1f), r.between(0.25f, 0.5f), r.between(0.55f, 0.8f));
  colors(m, c, c * 0.93f, c * 0.85f);
  const float rough = r.between(0.7f, 0.95f);
  roughness(m, rough, std::min(rough + 0.03f, 1.f), rough);
  m.scale = {3, 60, 3};
  cloud(m, 0.2f, 0.4f);
  return dressed(m);
}

Material Palette::trinket() {
  switch (random_.whole(0, 5)) {
    case 0:
      return make(MaterialClass::Ceramic);
    case 1:
      return make(MaterialClass::Plastic);
    case 2:
      return make(MaterialClass::Paper);
    case 3:
      return stone_only() ? make(MaterialClass::Stone) : make(MaterialClass::Wood);
    case 4:
      return make(MaterialClass::GlossPaint);
    default:
      return random_.chance(0.6f) ? make(MaterialClass::Paper) : make(MaterialClass::Metal);
  }
}

}  // namespace clerestory
