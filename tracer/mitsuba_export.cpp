#include "tracer/mitsuba_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "tracer/light_tables.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "PLY files are written as memory holds the numbers");

constexpr std::size_t kVertexReals = 9;
constexpr double kSquare = 1e-6;  // how far the two focal lengths may differ, as a share
constexpr const char* kPanoramaFile = "panorama.exr";
constexpr std::array kTextures = {"plain", "plaster", "wood", "tiles",    "fabric", "stone",
                                  "metal", "leather", "rug",  "painting", "print"};

using Row = std::array<float, kVertexReals>;

/// A mesh while triangles are added.
struct Growing {
  MitsubaMesh mesh;
  std::map<Row, std::int32_t> number_of;

  std::int32_t vertex(const Vertex& v, const glm::vec3& normal) {
    const Row row = {v.position.x, v.position.y, v.position.z, normal.x, normal.y, normal.z, v.uvw.x, v.uvw.y, v.uvw.z};
    const auto [at, is_new] = number_of.try_emplace(row, static_cast<std::int32_t>(number_of.size()));
    if (is_new) mesh.vertices.insert(mesh.vertices.end(), row.begin(), row.end());
    return at->second;
  }
};

std::string mesh_file(std::size_t number) { return fmt::format("meshes/{:03}.ply", number); }

/// Mitsuba takes the normals nx, ny, nz of a mesh for those of its surface also where it samples a lamp by area, so
/// lamps are flat to it; what shading needs comes under another name.
std::string ply(const MitsubaMesh& mesh) {
  const char* normal = mesh.emitter < 0 ? "n" : "shading_";
  std::string bytes =
      fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.vertices.size() / kVertexReals);
  for (const char axis : {'x', 'y', 'z'}) bytes += fmt::format("property float {}\n", axis);
  for (const char axis : {'x', 'y', 'z'}) bytes += fmt::format("property float {}{}\n", normal, axis);
  for (const char axis : {'x', 'y', 'z'}) bytes += fmt::format("property float uvw_{}\n", axis);
  bytes +=
      fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.indices.size() / 3);
  bytes.append(reinterpret_cast<const char*>(mesh.vertices.data()), mesh.vertices.size() * sizeof(float));
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    bytes.push_back(3);
    bytes.append(reinterpret_cast<const char*>(&mesh.indices[i]), 3 * sizeof(std::int32_t));
  }
  return bytes;
}

std::string number(const char* name, double value) {
  return fmt::format("    <float name=\"{}\" value=\"{}\"/>\n", name, static_cast<float>(value));
}

std::string vector(const char* name, const glm::vec3& v) {
  return fmt::format("    <vector name=\"{}\" x=\"{}\" y=\"{}\" z=\"{}\"/>\n", name, v.x, v.y, v.z);
}

std::string flag(const char* name, bool value) {
  return fmt::format("    <boolean name=\"{}\" value=\"{}\"/>\n", name, value);
}

/// Mitsuba's cameras have x to the left and look along z.
std::string sensor(const Camera& camera, std::size_t view) {
  if (std::abs(camera.fx / camera.fy - 1) > kSquare)
    throw usage_error("pixels are not square, and Mitsuba knows no others", fmt::format("view {}", view),
                      fmt::format("fx {}, fy {}", camera.fx, camera.fy), "one focal length");
  std::string rows;
  for (std::size_t i = 0; i < 16; ++i) {
    const double turned = i % 4 == 0 || i % 4 == 2 ? -1 : 1;
    rows += fmt::format("{}{}", i > 0 ? " " : "", turned * camera.camera_to_world[i]);
  }
  const double fov = 2 * std::atan(camera.width / (2 * camera.fx)) * 180 / std::numbers::pi;
  std::string text = fmt::format("  <sensor type=\"perspective\" id=\"view-{:03}\">\n", view);
  text += "    <string name=\"fov_axis\" value=\"x\"/>\n";
  text += fmt::format("    <float name=\"fov\" value=\"{}\"/>\n", fov);
  text += fmt::format("    <float name=\"principal_point_offset_x\" value=\"{}\"/>\n", camera.cx / camera.width - 0.5);
  text += fmt::format("    <float name=\"principal_point_offset_y\" value=\"{}\"/>\n", camera.cy / camera.height - 0.5);
  text += "    <float name=\"near_clip\" value=\"0.001\"/>\n";
  text += fmt::format("    <transform name=\"to_world\"><matrix value=\"{}\"/></transform>\n", rows);
  text += fmt::format(
      "    <film type=\"hdrfilm\">\n      <integer name=\"width\" value=\"{}\"/>\n      <integer name=\"height\" "
      "value=\"{}\"/>\n      <rfilter type=\"box\"/>\n    </film>\n    <sampler type=\"independent\"/>\n",
      camera.width, camera.height);
  return text + "  </sensor>\n";
}

/// smooth_lamp: shading normals come as an attribute of the mesh.
std::string bsdf(const Material& m, const std::string& id, bool smooth_lamp) {
  std::string text = fmt::format("  <bsdf type=\"clerestory\" id=\"{}\">\n", id);
  text +=
      fmt::format("    <string name=\"texture\" value=\"{}\"/>\n", kTextures.at(static_cast<std::size_t>(m.texture)));
  text += vector("color_a", m.color_a) + vector("color_b", m.color_b) + vector("color_c", m.color_c);
  text += vector("roughness", {m.roughness_a, m.roughness_b, m.roughness_c});
  text += vector("metallic", {m.metallic_a, m.metallic_b, m.metallic_c});
  text += vector("scale", m.scale);
  text += number("gap", m.gap) + number("tint", m.tint) + number("warp", m.warp) + number("noise", m.noise);
  text += number("seed", m.seed) + number("wear", m.wear) + number("pattern", m.pattern);
  text += number("smudge", m.smudge) + number("smudge_scale", m.smudge_scale);
  text += number("stain", m.stain) + number("stain_scale", m.stain_scale);
  return text + flag("uncapped", m.uncapped != 0) + flag("smooth_lamp", smooth_lamp) + "  </bsdf>\n";
}

std::string emitter(const World& world, const MitsubaMesh& mesh, const LightTables& light) {
  const auto at = static_cast<std::size_t>(mesh.emitter);
  const Emitter& e = world.emitters[at];
  const double share = static_cast<double>(light.emitters[8 * at + 4]) * mesh.area;
  std::string text = fmt::format("    <emitter type=\"{}\">\n", e.panorama ? "clerestory_pane" : "area");
  text += fmt::format("      <float name=\"sampling_weight\" value=\"{}\"/>\n", share);
  if (e.panorama)
    text += "  " + vector("factor", e.radiance) + "  " + number("turn", world.panorama_turn) +
            fmt::format("      <string name=\"panorama\" value=\"{}\"/>\n", kPanoramaFile);
  else
    text +=
        fmt::format("      <rgb name=\"radiance\" value=\"{}, {}, {}\"/>\n", e.radiance.x, e.radiance.y, e.radiance.z);
  return text + "    </emitter>\n";
}

std::string scene_xml(const World& world, const std::vector<Camera>& cameras, const std::vector<MitsubaMesh>& meshes) {
  const LightTables light = make_light_tables(world);
  std::string text =
      "<!-- A room of clerestory for Mitsuba 3; the plug-ins are experiments/peers/clerestory_brdf.py. -->\n"
      "<scene version=\"3.0.0\">\n";
  // Mitsuba counts the edges of a path that ends in a lamp, the tracer its scatterings.
  text += fmt::format("  <integrator type=\"path\"><integer name=\"max_depth\" value=\"{}\"/></integrator>\n",
                      kMaxDepth + 1);
  for (std::size_t v = 0; v < cameras.size(); ++v) text += sensor(cameras[v], v);
  const auto material = [&](std::size_t i) { return world.materials[static_cast<std::size_t>(meshes[i].material)]; };
  std::vector<std::string> names;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const bool smooth_lamp = meshes[i].emitter >= 0 && meshes[i].smooth;
    names.push_back(fmt::format("material-{}{}", meshes[i].material, smooth_lamp ? "-smooth-lamp" : ""));
    if (std::ranges::count(names, names.back()) == 1) text += bsdf(material(i), names.back(), smooth_lamp);
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    text += fmt::format("  <shape type=\"ply\">\n    <string name=\"filename\" value=\"{}\"/>\n    <ref id=\"{}\"/>\n",
                        mesh_file(i), names[i]);
    if (meshes[i].emitter >= 0) text += emitter(world, meshes[i], light);
    text += "  </shape>\n";
  }
  return text + "</scene>\n";
}

Image planar(const Panorama& panorama) {
  Image image(panorama.width, panorama.height, 3);
  for (std::size_t i = 0; i < image.pixels(); ++i)
    for (std::size_t c = 0; c < 3; ++c) image.data[c * image.pixels() + i] = panorama.rgb[3 * i + c];
  return image;
}

}  // namespace

std::vector<MitsubaMesh> mitsuba_meshes(const World& world) {
  std::map<std::pair<int, int>, Growing> by_surface;
  for (const Triangle& t : world.triangles) {
    const glm::vec3 cross = glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position);
    const float length = glm::length(cross);
    if (!(length > 0)) continue;
    Growing& to = by_surface[{t.material, t.emitter}];
    to.mesh.material = t.material, to.mesh.emitter = t.emitter;
    to.mesh.smooth = to.mesh.smooth || t.smooth;
    to.mesh.area += static_cast<double>(length) / 2;
    for (const Vertex& v : t.v)
      to.mesh.indices.push_back(to.vertex(v, t.smooth ? glm::normalize(v.normal) : cross / length));
  }
  std::vector<MitsubaMesh> meshes;
  for (auto& [surface, growing] : by_surface) meshes.push_back(std::move(growing.mesh));
  return meshes;
}

void write_mitsuba_scene(const fs::path& folder, const World& world, const std::vector<Camera>& cameras) {
  fs::path unfinished = folder;
  unfinished += ".part";
  fs::remove_all(unfinished);
  make_directories(unfinished / "meshes");
  const std::vector<MitsubaMesh> meshes = mitsuba_meshes(world);
  for (std::size_t i = 0; i < meshes.size(); ++i) write_file(unfinished / mesh_file(i), ply(meshes[i]));
  const auto shows = [](const Emitter& e) { return e.panorama; };
  if (std::ranges::any_of(world.emitters, shows))
    write_exr(unfinished / kPanoramaFile, planar(world.panorama), ExrType::Float);
  write_file(unfinished / "scene.xml", scene_xml(world, cameras, meshes));
  std::error_code error;
  fs::rename(unfinished, folder, error);
  if (error)
    throw Error(ErrorKind::Failed, "a scene of Mitsuba cannot be put in place", folder.string(), error.message());
}

}  // namespace clerestory
