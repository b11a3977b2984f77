// What each class of material looks like, before it is lived with.
#include <algorithm>

#include "tracer/material_parts.hpp"
#include "tracer/palette.hpp"

namespace clerestory {

Material Palette::made_wall_paint() {
  Random& r = random_;
  Material m = textured(Texture::Plaster, r);
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

Material Palette::made_gloss_paint() {
  Random& r = random_;
  Material m = textured(Texture::Plain, r);
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
  Material m = textured(Texture::Wood, r);
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

Material Palette::made_tile() {
  Random& r = random_;
  Material m = textured(Texture::Tiles, r);
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

Material Palette::made_stone() {
  Random& r = random_;
  if (!stone_only()) return made(r.chance(0.5f) ? MaterialClass::Tile : MaterialClass::Concrete);
  Material m = textured(Texture::Stone, r);
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

Material Palette::made_fabric() {
  Random& r = random_;
  Material m = textured(Texture::Fabric, r);
  const glm::vec3 c =
      r.chance(0.45f) ? hsv(r.between(0.04f, 0.16f), r.between(0.02f, 0.3f), r.between(0.3f, 0.85f)) : strong_color();
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

Material Palette::made_leather() {
  Random& r = random_;
  Material m = textured(Texture::Leather, r);
  const glm::vec3 c = r.chance(0.7f) ? hsv(r.between(0.02f, 0.08f), r.between(0.3f, 0.75f), r.between(0.12f, 0.55f))
                                     : strong_color() * 0.6f;
  colors(m, c * 0.6f, c, c * 1.25f);
  const float rough = r.between(0.3f, 0.45f);
  roughness(m, rough + 0.25f, rough, rough + 0.15f);
  m.scale = glm::vec3(r.between(50.f, 110.f));
  m.wear = r.between(0, 0.4f);
  return m;
}

Material Palette::made_plastic() {
  Random& r = random_;
  Material m = textured(Texture::Plain, r);
  const glm::vec3 c = r.chance(0.4f) ? grey(r.one_of({0.12f, 0.25f, 0.5f, 0.85f})) : strong_color();
  colors(m, c, c * 0.97f, c * 0.9f);
  const float rough = r.between(0.22f, 0.52f);
  roughness(m, rough, rough + 0.03f, rough + 0.15f);
  m.scale = glm::vec3(3);
  m.wear = r.chance(0.3f) ? 0.3f : 0;
  return m;
}

Material Palette::made_ceramic() {
  Random& r = random_;
  Material m = textured(Texture::Plain, r);
  const glm::vec3 c = r.chance(0.5f) ? hsv(0.12f, r.between(0, 0.1f), r.between(0.8f, 0.9f)) : strong_color();
  colors(m, c, c * 0.96f, c);
  const float rough = r.between(0.05f, 0.16f);
  roughness(m, rough, rough + 0.02f, rough);
  m.scale = glm::vec3(8);
  return m;
}

Material Palette::made_metal() {
  Random& r = random_;
  Material m = textured(Texture::Metal, r);
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

Material Palette::made_carpet() {
  Random& r = random_;
  Material m = textured(Texture::Fabric, r);
  const glm::vec3 c =
      r.chance(0.6f) ? hsv(r.between(0.04f, 0.14f), r.between(0.03f, 0.3f), r.between(0.35f, 0.78f)) : strong_color();
  colors(m, c, c * r.between(0.75f, 0.95f), c);
  roughness(m, 0.96f, 1, 1);
  m.scale = glm::vec3(r.between(3.f, 12.f));
  m.tint = 0.1f;
  m.noise = r.between(0.03f, 0.12f);
  return m;
}

Material Palette::made_paper() {
  Random& r = random_;
  Material m = textured(Texture::Plain, r);
  const glm::vec3 c = strong_color();
  colors(m, c, c * 0.95f, c * 0.8f);
  const float rough = r.between(0.6f, 0.9f);
  roughness(m, rough, rough, rough);
  m.scale = glm::vec3(6);
  return m;
}

Material Palette::made_concrete() {
  Random& r = random_;
  Material m = textured(Texture::Plaster, r);
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

}  // namespace clerestory
