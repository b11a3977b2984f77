// glTF: the shipped Draco meshes, hand-written scenes with transforms, strips and mirrors, and broken files.
#include "host/io/mesh_file.hpp"

#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "tests/io/testing.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

std::string base64(const std::string& bytes) {
  static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k)
      v = v << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? digits[v >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

template <class T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

class Meshes : public Scratch {
 protected:
  // A unit right triangle in the xy plane, facing +z; u16 indices 0 1 2 (and 2 1 3 of the square).
  std::filesystem::path scene(const std::string& nodes, const std::string& primitive,
                              const std::string& extra = "") const {
    const std::string positions = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
    const std::string indices = raw<std::uint16_t>({0, 1, 2, 2, 1, 3}), uvs = raw<float>({0, 0, 1, 0, 0, 1, 1, 1});
    const std::string data = positions + indices + uvs;
    return put("scene.gltf",
               R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" + std::to_string(data.size()) +
                   R"(,"uri":"data:application/octet-stream;base64,)" + base64(data) + R"("}],"bufferViews":[)" +
                   R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},)" +
                   R"({"buffer":0,"byteOffset":60,"byteLength":32}],"accessors":[)" +
                   R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)" +
                   R"({"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},)" +
                   R"({"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}],)" +
                   R"("meshes":[{"primitives":[)" + primitive + R"(]}],"nodes":[)" + nodes + "]" + extra + "}");
  }
  static constexpr const char* square = R"({"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1})";
};

// Turned, scaled and moved: sixteen roundings of coordinates near 1.
constexpr float kOfPlace = 16 * static_cast<float>(kFloatRounding);

void expect_near(const std::array<float, 3>& a, const std::array<float, 3>& b, float tolerance = kOfPlace) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance);
}

TEST_F(Meshes, ShippedDracoMeshes) {
  struct Known {
    const char* name;
    std::size_t triangles, vertices;
    std::array<float, 3> low, high;
  };
  // Counts and corners as the accessors of the files state them.
  for (const Known& known :
       {Known{"bunny", 16944 / 3, 2826, {-0.9137708f, -0.8910416f, -0.6963725f}, {0.9172143f, 0.9398829f, 0.6988643f}},
        {"suzi", 44526 / 3, 7503, {-0.9297301f, -0.6697948f, -0.5447863f}, {0.9297301f, 0.6682535f, 0.5761585f}}}) {
    const Mesh mesh = read_mesh(asset(std::string("models/") + known.name + ".glb"));
    EXPECT_EQ(mesh.indices.size(), known.triangles) << known.name;
    EXPECT_EQ(mesh.positions.size(), known.vertices) << known.name;
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    EXPECT_TRUE(mesh.uvs.empty());
    // Draco quantises positions to 14 bits or fewer of the extent.
    expect_near(bounds(mesh).low, known.low, 2.0f / 4096);
    expect_near(bounds(mesh).high, known.high, 2.0f / 4096);
    double agree = 0;
    for (const auto& n : mesh.normals)
      ASSERT_NEAR(std::hypot(n[0], n[1], n[2]), 1, 4 * kFloatRounding);  // of each part, and of the length
    for (const auto& t : mesh.indices) {
      double e[2][3], normal = 0;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 2; ++k) e[k][i] = mesh.positions[t[k + 1]][i] - mesh.positions[t[0]][i];
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        normal += (e[0][j] * e[1][k] - e[0][k] * e[1][j]) * mesh.normals[t[0]][i];
      }
      agree += normal > 0;
    }
    EXPECT_GT(agree / static_cast<double>(mesh.indices.size()), 0.95) << "normals face the winding's side";
  }
}

TEST_F(Meshes, TransformsOfNodes) {
  // Parent: x by 10; child: a quarter turn about z, scaled by 2: (x, y) -> (10 - 2y, 2x).
  const Mesh mesh =
      read_mesh(scene(R"({"children":[1],"translation":[10,0,0]},)"
                      R"({"mesh":0,"rotation":[0,0,0.70710678118654757,0.70710678118654757],"scale":[2,2,2]})",
                      square, R"(,"scenes":[{"nodes":[0]}],"scene":0)"));
  ASSERT_EQ(mesh.positions.size(), 4u);
  expect_near(mesh.positions[1], {10, 2, 0}, 10 * kOfPlace);
  expect_near(mesh.positions[2], {8, 0, 0}, 10 * kOfPlace);
  expect_near(mesh.normals[3], {0, 0, 1});
  EXPECT_EQ(mesh.indices, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_EQ(mesh.uvs[3], (std::array<float, 2>{1, 1}));

  // The same by a column-major matrix, without any scene.
  const Mesh same = read_mesh(scene(R"({"mesh":0,"matrix":[0,2,0,0,-2,0,0,0,0,0,2,0,10,0,0,1]})", square));
  for (std::size_t i = 0; i < 4; ++i) expect_near(same.positions[i], mesh.positions[i], 10 * kOfPlace);
}

TEST_F(Meshes, NormalsUnderUnevenScaleAndMirror) {
  // Tilted by 45 degrees about y, then squeezed along z: the normal turns towards z, not with the surface.
  const Mesh mesh = read_mesh(
      scene(R"({"children":[1],"scale":[1,1,0.5]},{"mesh":0,"rotation":[0,0.38268343236508978,0,0.92387953251128674]})",
            square));
  expect_near(mesh.normals[0], {1 / std::sqrt(5.0f), 0, 2 / std::sqrt(5.0f)});
  const Mesh mirrored = read_mesh(scene(R"({"mesh":0,"scale":[-1,1,1]})", square));
  expect_near(mirrored.positions[1], {-1, 0, 0});
  EXPECT_EQ(mirrored.indices[0], (std::array<std::uint32_t, 3>{0, 2, 1})) << "still counter-clockwise from outside";
  expect_near(mirrored.normals[0], {0, 0, 1});
}

TEST_F(Meshes, PrimitivesAreMerged) {
  const Mesh mesh =
      read_mesh(scene(R"({"mesh":0})", R"({"attributes":{"POSITION":0},"indices":1},)" + std::string(square)));
  EXPECT_EQ(mesh.positions.size(), 8u);
  EXPECT_EQ(mesh.indices[2], (std::array<std::uint32_t, 3>{4, 5, 6}));
  ASSERT_EQ(mesh.uvs.size(), 8u) << "zeros for the primitive without";
  EXPECT_EQ(mesh.uvs[3], (std::array<float, 2>{0, 0}));
  EXPECT_EQ(mesh.uvs[7], (std::array<float, 2>{1, 1}));
}

TEST_F(Meshes, StripsAndFans) {
  const Mesh strip = read_mesh(scene(R"({"mesh":0})", R"({"attributes":{"POSITION":0},"mode":5})"));
  EXPECT_EQ(strip.indices, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {2, 1, 3}}));
  const Mesh fan = read_mesh(scene(R"({"mesh":0})", R"({"attributes":{"POSITION":0},"mode":6})"));
  EXPECT_EQ(fan.indices, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  expect_error([&] { read_mesh(scene(R"({"mesh":0})", R"({"attributes":{"POSITION":0},"mode":1})")); }, {"mode 1"});
  expect_error([&] { read_mesh(scene(R"({"mesh":0})", R"({"attributes":{"POSITION":0}})")); }, {"multiple of 3"});
}

TEST_F(Meshes, BrokenScenes) {
  const auto refused = [&](const std::string& nodes, const std::string& primitive,
                           std::initializer_list<std::string> parts, const std::string& extra = "") {
    SCOPED_TRACE(nodes + primitive + extra);
    expect_error([&] { read_mesh(scene(nodes, primitive, extra)); }, parts);
  };
  const std::string node = R"({"mesh":0})", scenes = R"(,"scenes":[{"nodes":[0]}])";
  refused(R"({"children":[1]},{"children":[0],"mesh":0})", square, {"scene.gltf", "ancestor"}, scenes);
  refused(R"({"children":[1,1]},{"mesh":0})", square, {"two parents"}, scenes);
  refused(R"({"children":[7]})", square, {"node", "7"}, scenes);
  refused(R"({"mesh":3})", square, {"mesh", "3"});
  refused(R"({"translation":[1,0,0]})", square, {"no triangle"});
  refused(node + R"(,{"mesh":0,"scale":[0,1,1]})", square, {"singular"});
  refused(node, square, {"scene", "4"}, R"(,"scenes":[{"nodes":[0]}],"scene":4)");
  refused(node, R"({"attributes":{"TEXCOORD_0":2},"indices":1})", {"POSITION"});
  refused(node, R"({"attributes":{"POSITION":9},"indices":1})", {"accessor", "9"});
  refused(node, R"({"attributes":{"POSITION":2},"indices":1})", {"accessor 2", "wrong type"});
  refused(node, R"({"attributes":{"POSITION":0},"indices":8})", {"indices accessor"});
  refused(node, square, {"an extension", "EXT_meshopt_compression"},
          R"(,"extensionsRequired":["EXT_meshopt_compression"])");
  EXPECT_NO_THROW(read_mesh(scene(node, square, R"(,"extensionsRequired":["KHR_materials_unlit"])")));
}

TEST_F(Meshes, BrokenNumbers) {
  const auto refused = [&](const std::string& from, const std::string& to, std::initializer_list<std::string> parts) {
    SCOPED_TRACE(to);
    std::string text = get(scene(R"({"mesh":0})", square));
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
    expect_error([&] { read_mesh(put("scene.gltf", text)); }, parts);
  };
  refused(R"("count":4)", R"("count":400000000)", {"accessor 0", "outside", "400000000"});
  refused(R"("count":4)", R"("count":0)", {"accessor 0"});
  refused(R"("bufferView":0,"componentType")", R"("bufferView":0,"byteOffset":44,"componentType")",
          {"accessor 0", "outside"});
  refused(R"("byteLength":48)", R"("byteLength":4800)", {"buffer view 0", "outside"});
  refused(R"("buffer":0,"byteOffset":48)", R"("buffer":0,"byteOffset":18446744073709551615)", {"scene.gltf"});
  refused(R"("buffer":0,"byteOffset":48)", R"("buffer":0,"byteOffset":-12)", {"bufferViews[1].byteOffset", "-12"});
  refused(R"("buffer":0,"byteOffset":48)", R"("buffer":0,"byteStride":-2,"byteOffset":48)",
          {"bufferViews[1].byteStride", "-2"});
  refused(R"("count":4)", R"("count":4.5)", {"accessors[0].count", "4.5"});
  refused(R"({"buffer":0,"byteLength")", R"({"buffer":5,"byteLength")", {"buffer", "5"});
  refused(R"("type":"VEC2")", R"("type":"VEC3")", {"accessor 2", "wrong type"});
  refused(R"("componentType":5126)", R"("componentType":5130)", {"component type"});
  refused(
      R"("componentType":5126,"count":4,"type":"VEC3")",
      R"("componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}})",
      {"sparse"});
  refused(R"("asset")", R"("asset)", {"JSON"});
}

TEST_F(Meshes, BrokenPositionsAndIndices) {
  const auto glb = [&](const std::vector<float>& positions, const std::vector<std::uint32_t>& indices) {
    std::string json =
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" +
        std::to_string(positions.size() * 4 + indices.size() * 4) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" +
        std::to_string(positions.size() * 4) + R"(},{"buffer":0,"byteOffset":)" + std::to_string(positions.size() * 4) +
        R"(,"byteLength":)" + std::to_string(indices.size() * 4) +
        R"(}],"accessors":[{"bufferView":0,"componentType":5126,"count":)" + std::to_string(positions.size() / 3) +
        R"(,"type":"VEC3"},{"bufferView":1,"componentType":5125,"count":)" + std::to_string(indices.size()) +
        R"(,"type":"SCALAR"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}]})";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::string data = raw(positions) + raw(indices);
    const auto word = [](std::size_t v) { return raw<std::uint32_t>({static_cast<std::uint32_t>(v)}); };
    return put("a.glb", "glTF" + word(2) + word(28 + json.size() + data.size()) + word(json.size()) + "JSON" + json +
                            word(data.size()) + std::string("BIN\0", 4) + data);
  };
  const std::vector<float> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
  EXPECT_EQ(read_mesh(glb(triangle, {0, 1, 2})).indices.size(), 1u);
  expect_error([&] { read_mesh(glb(triangle, {0, 1, 3})); }, {"a.glb", "index", "3", "below 3"});
  expect_error([&] { read_mesh(glb({0, 0, 0, 1, 0, 0, 0, std::nanf(""), 0}, {0, 1, 2})); }, {"a.glb", "not finite"});
  // A triangle of no area has no direction: its vertices get +y rather than NaN.
  const Mesh flat = read_mesh(glb({0, 0, 0, 1, 0, 0, 2, 0, 0}, {0, 1, 2}));
  expect_near(flat.normals[0], {0, 1, 0});
}

// A file that somebody sent names others: only ones beside it may be read.
TEST_F(Meshes, BuffersAreReadFromItsOwnFolderOnly) {
  const std::string data = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
  put("secret.bin", data), put("home/mesh/own.bin", data), put("home/mesh/below/own file.bin", data);
  put("home/mesh/own%2fname.bin", data), put("home/mesh_twin/own.bin", data);
  const std::filesystem::path home = folder / "home/mesh";
  std::filesystem::create_symlink(folder / "secret.bin", home / "link.bin");
  std::filesystem::create_directory_symlink(folder, home / "up");
  std::filesystem::create_symlink("own.bin", home / "inner_link.bin");
  ASSERT_EQ(::mkfifo((home / "pipe.bin").c_str(), 0600), 0);
  const auto mesh = [&](const std::string& uri) {
    return put("home/mesh/m.gltf",
               R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":")" + uri +
                   R"("}],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,)" +
                   R"("componentType":5126,"count":3,"type":"VEC3"}],"meshes":[{"primitives":[)" +
                   R"({"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})");
  };
  for (const char* uri : {"own.bin", "below/own%20file.bin", "below/../own.bin", "inner_link.bin", "./own.bin"})
    EXPECT_EQ(read_mesh(mesh(uri)).indices.size(), 1u) << uri;

  const std::string absolute = (folder / "secret.bin").string();
  for (const std::string& uri :
       {std::string("../../secret.bin"), std::string("..%2f..%2Fsecret.bin"), std::string("%2e%2e/%2e%2e/secret.bin"),
        std::string("below/../../../secret.bin"), std::string("link.bin"), std::string("up/secret.bin"),
        std::string("../mesh_twin/own.bin")}) {
    SCOPED_TRACE(uri);
    expect_error([&] { read_mesh(mesh(uri)); }, {"m.gltf", "outside its folder"});
  }
  expect_error([&] { read_mesh(mesh("pipe.bin")); }, {"pipe.bin", "is not a regular file"});
  expect_error([&] { read_mesh(mesh("below")); }, {"below", "is a folder"});
  expect_error([&] { read_mesh(mesh("none.bin")); }, {"none.bin", "No such file"});
  for (const std::string& uri : {absolute, "%2f" + absolute.substr(1), "file://" + absolute})
    expect_error([&] { read_mesh(mesh(uri)); }, {"secret.bin"});

  // Named without a folder, it lies in the current one, and so must its buffers.
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(home);
  EXPECT_EQ((mesh("own.bin"), read_mesh("m.gltf").indices.size()), 1u);
  for (const std::string& uri : {std::string("../../secret.bin"), absolute})
    expect_error([&] { mesh(uri), read_mesh("m.gltf"); }, {"m.gltf", "outside its folder"});
  std::filesystem::current_path(before);
}

TEST_F(Meshes, NoMesh) {
  expect_error([&] { read_mesh(folder / "none.glb"); }, {"none.glb", "No such file"});
  expect_error([&] { read_mesh(folder); }, {"is a folder"});
  expect_error([&] { read_mesh(put("text.glb", "not a mesh")); }, {"text.glb"});
  expect_error([&] { read_mesh(put("v1.glb", std::string("glTF\1\0\0\0\x14\0\0\0\0\0\0\0JSON", 20))); },
               {"v1.glb", "version"});
  EXPECT_EQ(bounds(Mesh{}).high, (std::array<float, 3>{0, 0, 0}));
}

}  // namespace
}  // namespace clerestory
