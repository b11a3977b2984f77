#include "tracer/light_tables.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/math/panorama.hpp"

namespace clerestory {
namespace {

constexpr int kEmitterSize = 8;

float luminance(const glm::vec3& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

struct Facet {
  int triangle = 0, emitter = 0;
  float area = 0;
  glm::vec3 normal{0};
};

std::vector<Facet> emitting_facets(const World& scene) {
  std::vector<Facet> facets;
  for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
    const Triangle& t = scene.triangles[i];
    if (t.emitter < 0) continue;
    const glm::vec3 cross = glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position);
    const float length = glm::length(cross);
    if (length > 0) facets.push_back({static_cast<int>(i), t.emitter, length / 2, cross / length});
  }
  return facets;
}

/// Luminance times solid angle of every pixel of the panorama, and where in the world it stands.
struct Sky {
  std::vector<double> power;
  std::vector<glm::vec3> direction;
};

Sky make_sky(const World& scene) {
  const Panorama& p = scene.panorama;
  Sky sky;
  const float c = std::cos(scene.panorama_turn), s = std::sin(scene.panorama_turn);
  const auto pixel = [&](int x, int y) {
    const float* rgb = &p.rgb[3 * (static_cast<std::size_t>(y) * p.width + x)];
    return static_cast<double>(luminance({rgb[0], rgb[1], rgb[2]}));
  };
  for (int y = 0; y < p.height; ++y) {
    const double solid_angle = panorama_solid_angle(y, p.width, p.height);
    for (int x = 0; x < p.width; ++x) {
      const glm::vec3 d(panorama_direction(x, y, p.width, p.height));
      // The kernel looks a direction up `turn` to the right of its own place.
      sky.direction.push_back({c * d.x + s * d.z, d.y, -s * d.x + c * d.z});
      // The picture is read bilinearly, so a bright pixel shines into its neighbours: the mean over 3 x 3 covers them.
      double sum = 0;
      for (int k = 0; k < 9; ++k) {
        sum += pixel((x + k % 3 - 1 + p.width) % p.width, std::clamp(y + k / 3 - 1, 0, p.height - 1));
      }
      sky.power.push_back(sum / 9 * solid_angle);
    }
  }
  return sky;
}

/// Flux per area that comes through a pane with front normal n, before its factor.
double pane_exitance(const Sky& sky, const glm::vec3& n) {
  double sum = 0;
  for (std::size_t i = 0; i < sky.power.size(); ++i) {
    sum += sky.power[i] * static_cast<double>(std::max(0.f, -glm::dot(sky.direction[i], n)));
  }
  return sum;
}

/// Directions in proportion to the flux they send through the panes.
std::vector<float> sky_tables(const World& scene, const Sky& sky, const std::vector<Facet>& panes) {
  const std::size_t w = static_cast<std::size_t>(scene.panorama.width),
                    h = static_cast<std::size_t>(scene.panorama.height);
  std::vector<double> weight(w * h, 0);
  double total = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    double open = 0;
    for (const Facet& f : panes)
      open += static_cast<double>(f.area * std::max(0.f, -glm::dot(sky.direction[i], f.normal)));
    weight[i] = sky.power[i] * open;
    total += weight[i];
  }
  if (!(total > 0)) return {};
  std::vector<float> tables(h + 2 * w * h);
  double sum = 0;
  for (std::size_t y = 0; y < h; ++y) {
    double row = 0, in_row = 0;
    for (std::size_t x = 0; x < w; ++x) row += weight[y * w + x];
    sum += row;
    tables[y] = static_cast<float>(sum / total);
    const double solid_angle = panorama_solid_angle(static_cast<int>(y), static_cast<int>(w), static_cast<int>(h));
    for (std::size_t x = 0; x < w; ++x) {
      in_row += weight[y * w + x];
      tables[h + y * w + x] = row > 0 ? static_cast<float>(in_row / row) : 1.f;
      tables[h + (h + y) * w + x] = static_cast<float>(weight[y * w + x] / total / solid_angle);
    }
  }
  return tables;
}

}  // namespace

LightTables make_light_tables(const World& scene) {
  LightTables tables;
  const std::vector<Facet> facets = emitting_facets(scene);
  std::vector<Facet> panes;
  for (const Facet& f : facets) {
    if (scene.emitters[static_cast<std::size_t>(f.emitter)].panorama)
      panes.push_back(f), tables.panes.push_back(f.triangle);
  }
  const Sky sky = panes.empty() ? Sky() : make_sky(scene);

  // Triangles of an emitter go by area, emitters by luminous power: the density per area is one per emitter. Panes of
  // one emitter face one way, so the first one's flux stands for all.
  std::vector<double> exitance(scene.emitters.size(), -1), power;
  double total = 0, through_panes = 0;
  for (const Facet& f : facets) {
    const Emitter& e = scene.emitters[static_cast<std::size_t>(f.emitter)];
    double& m = exitance[static_cast<std::size_t>(f.emitter)];
    if (m < 0) {
      m = static_cast<double>(luminance(e.radiance)) * (e.panorama ? pane_exitance(sky, f.normal) : std::numbers::pi);
    }
    const Triangle& t = scene.triangles[static_cast<std::size_t>(f.triangle)];
    const glm::vec3 rows[4] = {t.v[0].position, t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position,
                               f.normal};
    for (const glm::vec3& row : rows) tables.lights.insert(tables.lights.end(), {row.x, row.y, row.z});
    tables.lights.insert(tables.lights.end(), {static_cast<float>(f.emitter), 0.f, 0.f, 0.f});
    power.push_back(m * static_cast<double>(f.area));
    total += power.back();
    if (e.panorama) through_panes += power.back();
  }
  tables.emitters.assign(scene.emitters.size() * kEmitterSize, 0.f);
  for (std::size_t i = 0; i < scene.emitters.size(); ++i) {
    const Emitter& e = scene.emitters[i];
    const float density = total > 0 ? static_cast<float>(std::max(exitance[i], 0.0) / total) : 0.f;
    const float row[kEmitterSize] = {e.radiance.x, e.radiance.y, e.radiance.z, e.panorama ? 1.f : 0.f, density};
    std::copy(row, row + kEmitterSize, &tables.emitters[i * kEmitterSize]);
  }
  if (!(total > 0)) {  // no light at all: nothing to choose
    tables.lights.clear();
    return tables;
  }
  double sum = 0;
  for (const double p : power) tables.cdf.push_back(static_cast<float>((sum += p) / total));
  tables.cdf.back() = 1;
  if (through_panes > 0) {
    tables.sky = sky_tables(scene, sky, panes);
    if (!tables.sky.empty()) tables.sky_share = static_cast<float>(0.5 * through_panes / total);
  }
  return tables;
}

}  // namespace clerestory
