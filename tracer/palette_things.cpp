// What a room asks its palette for: surfaces and things, by name.
#include <algorithm>

#include "tracer/material_parts.hpp"
#include "tracer/palette.hpp"

namespace clerestory {

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
  Material m = r.chance(0.5f) ? textured(Texture::Plaster, r) : patterned({Clouds, Mosaic, Patches}, 1.5f, 30);
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
  Material m = textured(kind < 0.35f ? Texture::Fabric : kind < 0.8f ? Texture::Rug : Texture::Painting, r);
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
  Material m = textured(Texture::Tiles, random_);
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
  Material m = textured(Texture::Rug, random_);
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
  Material m = textured(Texture::Painting, random_);
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
  Material m = textured(motif ? Texture::Rug : Texture::Painting, r);
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
  Material m = textured(Texture::Metal, random_);
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
  Material m = textured(Texture::Plain, random_);
  const glm::vec3 c(random_.between(0.035f, 0.09f), random_.between(0.1f, 0.27f), random_.between(0.03f, 0.07f));
  colors(m, c, c * 0.75f, c);
  const float rough = random_.between(0.35f, 0.6f);
  roughness(m, rough, rough + 0.1f, rough);
  m.scale = glm::vec3(6);
  return dressed(m);
}

Material Palette::enamel() {
  Material m = textured(Texture::Plain, random_);
  const glm::vec3 c = random_.chance(0.85f) ? hsv(0.12f, random_.between(0, 0.04f), random_.between(0.86f, 0.91f))
                                            : grey(random_.one_of({0.2f, 0.4f, 0.65f}));
  colors(m, c, c * 0.98f, c);
  const float rough = random_.between(0.06f, 0.22f);
  roughness(m, rough, rough + 0.02f, rough);
  return dressed(m);
}

Material Palette::mirror() {
  Material m = textured(Texture::Plain, random_);
  colors(m, glm::vec3(0.88f), glm::vec3(0.88f), glm::vec3(0.88f));
  roughness(m, 0.03f, 0.03f, 0.03f);
  m.metallic_a = m.metallic_b = m.metallic_c = 1;
  return dressed(m);
}

Material Palette::glass() {
  Material m = textured(Texture::Plain, random_);
  const glm::vec3 c = grey(random_.between(0.19f, 0.26f));
  colors(m, c, c, c);
  const float rough = random_.between(0.04f, 0.12f);
  roughness(m, rough, rough, rough);
  return dressed(m);
}

Material Palette::diffuser() {
  Material m = textured(Texture::Plain, random_);
  colors(m, grey(0.88f), grey(0.88f), grey(0.88f));
  roughness(m, 0.5f, 0.5f, 0.5f);
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
  Material m = textured(Texture::Plaster, r);
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
