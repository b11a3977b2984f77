// Rooms as scenes of Mitsuba: nothing of a room is lost or moved, cameras look the same way, a scene is there whole or
// not at all.
#include "tracer/mitsuba_export.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "tests/roundings.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/generate.hpp"
#include "tracer/room.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const fs::path kAssets = fs::path(CLERESTORY_SOURCE_DIR) / "assets";
using Corners = std::array<float, 9>;

struct MitsubaExport : testing::Test {
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "clerestory-mitsuba-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { fs::remove_all(folder); }
  std::string xml(const char* scene) const { return read_file(folder / scene / "scene.xml"); }

  fs::path folder;
};

Corners corners_of(const Triangle& t) {
  Corners c;
  for (std::size_t k = 0; k < 9; ++k) c[k] = t.v[k / 3].position[static_cast<int>(k % 3)];
  return c;
}

/// Triangles by material, emitter and corners, as a mesh has them.
using Surfaces = std::multiset<std::tuple<int, int, Corners>>;

Surfaces surfaces_of(const World& world) {
  Surfaces all;
  for (const Triangle& t : world.triangles) {
    if (glm::length(glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position)) > 0)
      all.insert({t.material, t.emitter, corners_of(t)});
  }
  return all;
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

/// All first groups of a pattern, as numbers.
std::vector<double> numbers_in(const std::string& text, const std::string& pattern) {
  std::vector<double> values;
  const std::regex regex(pattern);
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
    values.push_back(std::stod((*at)[1]));
  return values;
}

/// The first room of seeds 1, 2, ... with lamps and panes that are lit.
Room lit_room() {
  const RoomAssets assets = load_assets(kAssets, Setting::Training);
  for (std::uint64_t seed = 1;; ++seed) {
    Room room = make_room(seed, Setting::Training, assets);
    int panes = 0, lamps = 0;
    for (const Triangle& t : room.scene.triangles)
      if (t.emitter >= 0) ++(room.scene.emitters[static_cast<std::size_t>(t.emitter)].panorama ? panes : lamps);
    if (panes > 0 && lamps > 0) return room;
  }
}

TEST_F(MitsubaExport, MeshesHoldEveryTriangleOfARoomWhereItWas) {
  const World world = lit_room().scene;
  Surfaces found;
  double area = 0;
  for (const MitsubaMesh& mesh : mitsuba_meshes(world)) {
    ASSERT_EQ(mesh.indices.size() % 3, 0u);
    area += mesh.area;
    bool bent = false;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      Corners c;
      glm::vec3 corner[3], normal[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const float* v = &mesh.vertices.at(9 * static_cast<std::size_t>(mesh.indices[i + k]));
        std::copy_n(v, 3, c.begin() + static_cast<std::ptrdiff_t>(3 * k));
        corner[k] = {v[0], v[1], v[2]}, normal[k] = {v[3], v[4], v[5]};
        EXPECT_NEAR(glm::length(normal[k]), 1, 8 * kFloatRounding);
      }
      const glm::vec3 face = glm::normalize(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
      for (const glm::vec3& n : normal) bent = bent || glm::length(n - face) > 1e-3f;
      found.insert({mesh.material, mesh.emitter, c});
    }
    EXPECT_TRUE(mesh.smooth || !bent) << mesh.material;  // a smooth part may be flat, of one material
  }
  EXPECT_EQ(found, surfaces_of(world));
  double wanted = 0;
  for (const Triangle& t : world.triangles)
    wanted += static_cast<double>(
        glm::length(glm::cross(t.v[1].position - t.v[0].position, t.v[2].position - t.v[0].position)) / 2);
  EXPECT_NEAR(area, wanted, 16 * kFloatRounding * wanted);  // of an area
}

TEST_F(MitsubaExport, FilesHoldTheMeshesAndThePanorama) {
  const Room room = lit_room();
  write_mitsuba_scene(folder / "scene", room.scene, {});
  const std::vector<MitsubaMesh> meshes = mitsuba_meshes(room.scene);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const std::string bytes = read_file(folder / "scene" / fmt::format("meshes/{:03}.ply", i));
    const std::string end = "end_header\n";
    const std::size_t body = bytes.find(end) + end.size();
    EXPECT_THAT(bytes, HasSubstr(fmt::format("element vertex {}\n", meshes[i].vertices.size() / 9)));
    EXPECT_THAT(bytes, HasSubstr(fmt::format("element face {}\n", meshes[i].indices.size() / 3)));
    EXPECT_THAT(bytes.substr(0, body), HasSubstr(meshes[i].emitter < 0 ? "float nx" : "float shading_x"));
    const std::size_t reals = meshes[i].vertices.size() * sizeof(float);
    ASSERT_EQ(bytes.size(), body + reals + meshes[i].indices.size() / 3 * 13);
    EXPECT_EQ(std::memcmp(bytes.data() + body, meshes[i].vertices.data(), reals), 0);
    EXPECT_EQ(bytes[body + reals], 3);
    EXPECT_EQ(std::memcmp(bytes.data() + body + reals + 1, meshes[i].indices.data(), 12), 0);
  }
  const Image panorama = read_image(folder / "scene/panorama.exr");
  ASSERT_EQ(panorama.width, room.scene.panorama.width);
  ASSERT_EQ(panorama.height, room.scene.panorama.height);
  for (int y = 0; y < panorama.height; y += 37)
    for (int x = 0; x < panorama.width; x += 41)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(panorama.at(c, y, x),
                  room.scene.panorama.rgb[3 * (static_cast<std::size_t>(y) * panorama.width + x) + c]);
}

TEST_F(MitsubaExport, TheSceneNamesEveryMeshMaterialAndLampOnce) {
  const Room room = lit_room();
  write_mitsuba_scene(folder / "scene", room.scene, {});
  const std::string text = xml("scene");
  const std::vector<MitsubaMesh> meshes = mitsuba_meshes(room.scene);
  EXPECT_EQ(count_of(text, "<shape type=\"ply\">"), meshes.size());
  std::size_t lamps = 0, panes = 0;
  std::set<std::string> materials;
  for (const MitsubaMesh& mesh : meshes) {
    materials.insert(fmt::format("{} {}", mesh.material, mesh.emitter >= 0 && mesh.smooth));
    if (mesh.emitter >= 0) ++(room.scene.emitters[static_cast<std::size_t>(mesh.emitter)].panorama ? panes : lamps);
  }
  EXPECT_EQ(count_of(text, "<bsdf type=\"clerestory\""), materials.size());
  EXPECT_EQ(count_of(text, "<emitter type=\"area\">"), lamps);
  EXPECT_EQ(count_of(text, "<emitter type=\"clerestory_pane\">"), panes);
  double share = 0;
  for (const double s : numbers_in(text, "sampling_weight\" value=\"([^\"]*)\"")) share += s;
  EXPECT_NEAR(share, 1, 8 * kFloatRounding);  // lamps are chosen as the tracer chooses them
  EXPECT_THAT(text, HasSubstr(fmt::format("name=\"turn\" value=\"{}\"", room.scene.panorama_turn)));
}

TEST_F(MitsubaExport, NumbersOfAMaterialAreKept) {
  World world = plain_room();
  Material& m = world.materials[0];
  m.texture = static_cast<float>(Texture::Tiles);
  m.color_a = {0.1f, 0.2f, 0.3f}, m.color_c = {0.7f, 0.8f, 0.9f};
  m.roughness_a = 0.15f, m.roughness_b = 0.25f, m.roughness_c = 0.35f, m.metallic_c = 0.5f;
  m.scale = {3, 4, 5}, m.gap = 0.06f, m.tint = 0.07f, m.warp = 0.08f, m.noise = 0.09f, m.seed = 77, m.wear = 0.11f;
  m.pattern = 2, m.uncapped = 1;
  write_mitsuba_scene(folder / "scene", world, {});
  const std::string text = xml("scene");
  for (const char* line :
       {"name=\"texture\" value=\"tiles\"", "name=\"color_a\" x=\"0.1\" y=\"0.2\" z=\"0.3\"",
        "name=\"color_c\" x=\"0.7\" y=\"0.8\" z=\"0.9\"", "name=\"roughness\" x=\"0.15\" y=\"0.25\" z=\"0.35\"",
        "name=\"metallic\" x=\"0\" y=\"0\" z=\"0.5\"", "name=\"scale\" x=\"3\" y=\"4\" z=\"5\"",
        "name=\"gap\" value=\"0.06\"", "name=\"tint\" value=\"0.07\"", "name=\"warp\" value=\"0.08\"",
        "name=\"noise\" value=\"0.09\"", "name=\"seed\" value=\"77\"", "name=\"wear\" value=\"0.11\"",
        "name=\"pattern\" value=\"2\"", "name=\"uncapped\" value=\"true\""})
    EXPECT_THAT(text, HasSubstr(line));
  EXPECT_THAT(text, Not(HasSubstr("panorama")));
  EXPECT_FALSE(fs::exists(folder / "scene/panorama.exr"));
}

TEST_F(MitsubaExport, ASensorLooksWhereItsCameraLooks) {
  Camera camera = Camera::from_fov(64, 48, 70);
  look_at(camera, {1, 1.5, -2}, {-0.3, 0.8, 0.4});
  write_mitsuba_scene(folder / "scene", plain_room(), {camera, camera});
  const std::string text = xml("scene");
  EXPECT_THAT(text, HasSubstr("id=\"view-000\""));
  EXPECT_THAT(text, HasSubstr("id=\"view-001\""));
  EXPECT_NEAR(numbers_in(text, "name=\"fov\" value=\"([^\"]*)\"").at(0), 70, 70 * 8 * kDoubleRounding);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(text, found, std::regex("<matrix value=\"([^\"]*)\"")));
  std::istringstream stream(found[1]);
  std::array<double, 16> m{};
  for (double& v : m) ASSERT_TRUE(stream >> v);
  for (std::size_t row = 0; row < 3; ++row) {
    EXPECT_NEAR(m[4 * row], -camera.direction_to_world({1, 0, 0})[static_cast<int>(row)],
                2 * kDoubleRounding);  // x: to the left
    EXPECT_NEAR(m[4 * row + 1], camera.direction_to_world({0, 1, 0})[static_cast<int>(row)], 2 * kDoubleRounding);
    EXPECT_NEAR(m[4 * row + 2], camera.direction_to_world({0, 0, -1})[static_cast<int>(row)], 2 * kDoubleRounding);
    EXPECT_NEAR(m[4 * row + 3], camera.position()[static_cast<int>(row)], 2 * kDoubleRounding);
  }
}

TEST_F(MitsubaExport, ACameraThatMitsubaCannotHaveIsRefusedAndNothingIsLeft) {
  Camera camera = Camera::from_fov(64, 48, 70);
  camera.fy *= 1.1;
  try {
    write_mitsuba_scene(folder / "scene", plain_room(), {camera});
    FAIL() << "pixels that are not square were taken";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_THAT(e.what(), HasSubstr("view 0"));
  }
  EXPECT_FALSE(fs::exists(folder / "scene"));
}

TEST_F(MitsubaExport, WhatAnInterruptionLeftIsNotInTheScene) {
  make_directories(folder / "scene.part/meshes");
  write_file(folder / "scene.part/meshes/999.ply", "half a mesh");
  write_mitsuba_scene(folder / "scene", plain_room(), {});
  EXPECT_TRUE(fs::exists(folder / "scene/scene.xml"));
  EXPECT_FALSE(fs::exists(folder / "scene/meshes/999.ply"));
  EXPECT_FALSE(fs::exists(folder / "scene.part"));
}

TEST_F(MitsubaExport, ADataSetGetsItsScenesLater) {
  GenerateOptions o;
  o.out = folder / "set", o.rooms.count = 2, o.views.count = 1, o.views.width = 32, o.views.height = 24,
  o.views.spp = 1, o.light.wanted = false;
  o.rooms.boxes = true;
  generate(test_device(), o);
  const fs::path view = o.out / room_name(o, 0) / "000_im.exr";
  const auto made = fs::last_write_time(view);
  o.mitsuba = true;
  GenerateSummary summary = generate(test_device(), o);
  EXPECT_EQ(summary.made, 0);
  EXPECT_EQ(summary.scenes, 2);
  EXPECT_EQ(fs::last_write_time(view), made);
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(count_of(read_file(o.out / room_name(o, i) / "mitsuba/scene.xml"), "<sensor "), 1u);
  summary = generate(test_device(), o);
  EXPECT_EQ(summary.scenes, 0);
}

}  // namespace
}  // namespace clerestory
