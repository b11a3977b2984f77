// glTF through tinygltf. Its own Draco path indexes with numbers of the file unchecked, so it stays switched off and
// Draco's streams are decoded below; parts of a file that hold no geometry are cut out before it sees them.
#include "host/io/mesh_file.hpp"

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <draco/compression/decode.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/math/vec.hpp"

namespace clerestory {
namespace {

using Json = nlohmann::json;

constexpr const char* draco_name = "KHR_draco_mesh_compression";
constexpr std::uint64_t max_mesh_bytes = std::uint64_t{1} << 30;
constexpr std::size_t max_vertices = 1 << 24, max_corners = 3 << 24;  // a small file can name one accessor many times

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

void put(std::string& bytes, std::uint32_t value) { bytes.append(reinterpret_cast<const char*>(&value), 4); }

// A file apart: its JSON, and the binary chunk of a .glb with its header (empty for .gltf).
struct Parts {
  Json json;
  std::string binary;
};

Parts take_apart(const std::string& bytes, const std::string& where) {
  if (bytes.substr(0, 4) != "glTF") {
    if (const std::size_t first = bytes.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
        first != std::string::npos && bytes[first] != '{')
      throw usage_error("is no glTF", where, "neither \"glTF\" nor JSON at its start", "a .glb or .gltf");
    return {parse_json_object(bytes, where), {}};
  }
  if (bytes.size() < 20 || word(bytes, 8) != bytes.size())
    throw usage_error("the binary glTF is truncated", where, fmt::format("{} bytes", bytes.size()),
                      bytes.size() < 12 ? "a header" : fmt::format("{}", word(bytes, 8)));
  if (word(bytes, 4) != 2) throw usage_error("wrong version of glTF", where, fmt::format("{}", word(bytes, 4)), "2");
  const std::uint64_t json_bytes = word(bytes, 12);
  if (word(bytes, 16) != 0x4E4F534A || 20 + json_bytes > bytes.size())
    throw usage_error("the first chunk of the binary glTF is damaged", where);
  return {parse_json_object(std::string_view(bytes).substr(20, json_bytes), where), bytes.substr(20 + json_bytes)};
}

/// The reader takes a number of bytes below zero, or a broken one, for none at all.
void check_counts(const Json& json, const std::string& where) {
  for (const char* list : {"bufferViews", "accessors", "buffers"}) {
    if (!json.contains(list) || !json[list].is_array()) continue;
    for (std::size_t i = 0; i < json[list].size(); ++i)
      for (const char* key : {"byteOffset", "byteLength", "byteStride", "count"})
        if (const Json& entry = json[list][i];
            entry.is_object() && entry.contains(key) && !entry[key].is_number_unsigned())
          throw usage_error("is no whole number from 0 on", fmt::format("{}: {}[{}].{}", where, list, i, key),
                            brief(entry[key]));
  }
}

void check_extensions(const Json& json, const std::string& where) {
  if (!json.contains("extensionsRequired") || !json["extensionsRequired"].is_array()) return;
  for (const Json& name : json["extensionsRequired"]) {
    const std::string text = name.is_string() ? name.get<std::string>() : brief(name);
    // Looks and lights are not read anyway; what else a file requires may be about its shape.
    const bool looks = text.starts_with("KHR_materials_") || text.starts_with("KHR_texture_") ||
                       text.starts_with("EXT_texture_") || text.starts_with("KHR_lights_");
    if (!looks && text != draco_name && text != "KHR_mesh_quantization")
      throw usage_error("the file requires an extension that is not read", where, text);
  }
}

// Leaves geometry only. The indices of a Draco primitive go, as their accessor points nowhere and tinygltf minds.
void keep_geometry(Json& json) {
  for (const char* key : {"images", "textures", "samplers", "materials", "animations", "skins", "cameras"})
    json.erase(key);
  if (!json.contains("meshes") || !json["meshes"].is_array()) return;
  for (Json& mesh : json["meshes"]) {
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
    for (Json& primitive : mesh["primitives"]) {
      if (!primitive.is_object()) continue;
      primitive.erase("targets");
      const bool draco = primitive.contains("extensions") && primitive["extensions"].is_object() &&
                         primitive["extensions"].contains(draco_name);
      if (draco) primitive.erase("indices");
    }
  }
}

// What a file names is read from its own folder or one below it, whatever dots, escapes and links say.
void check_beside(const std::filesystem::path& named, const std::filesystem::path& mesh) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path home = fs::weakly_canonical(mesh.has_parent_path() ? mesh.parent_path() : "."),
                 real = fs::weakly_canonical(named, error);
  if (error) throw usage_error("names a file that cannot be opened: " + error.message(), mesh.string(), named.string());
  if (std::mismatch(home.begin(), home.end(), real.begin(), real.end()).first != home.end())
    throw usage_error("names a file outside its folder", mesh.string(), named.string(), "one in " + home.string());
}

// Hands tinygltf the files that a mesh names; it has joined them to the mesh's folder and taken their escapes away.
// Errors are thrown, through it, so that they say more than that there is no such file.
tinygltf::FsCallbacks files_beside(const std::filesystem::path& mesh) {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string&, void*) { return true; };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>* out, std::string*, const std::string& path, void* user) {
    check_beside(path, *static_cast<const std::filesystem::path*>(user));
    const std::string bytes = read_file(path, max_mesh_bytes);
    out->assign(bytes.begin(), bytes.end());
    return true;
  };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  callbacks.user_data = const_cast<std::filesystem::path*>(&mesh);
  return callbacks;
}

tinygltf::Model load_model(const std::filesystem::path& path) {
  const std::string where = path.string();
  const std::string bytes = read_file(path, max_mesh_bytes);
  Parts parts = take_apart(bytes, where);
  check_extensions(parts.json, where);
  check_counts(parts.json, where);
  keep_geometry(parts.json);
  std::string text = parts.json.dump(-1, ' ', true, Json::error_handler_t::replace);

  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(files_beside(path));
  tinygltf::Model model;
  std::string error, warning;
  bool loaded = false;
  const std::string folder = path.parent_path().string();
  if (bytes.substr(0, 4) == "glTF") {
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string glb = "glTF";
    put(glb, 2), put(glb, static_cast<std::uint32_t>(20 + text.size() + parts.binary.size()));
    put(glb, static_cast<std::uint32_t>(text.size())), put(glb, 0x4E4F534A);
    glb += text + parts.binary;
    loaded = loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(glb.data()),
                                         static_cast<unsigned>(glb.size()), folder);
  } else {
    loaded =
        loader.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), folder);
  }
  if (!loaded || !error.empty()) {
    std::replace(error.begin(), error.end(), '\n', ' ');
    throw usage_error("is no valid glTF: " + (error.empty() ? "unknown error" : error), where);
  }
  return model;
}

template <class T>
const T& element(const std::vector<T>& all, int index, const char* what, const std::string& where) {
  if (index < 0 || static_cast<std::size_t>(index) >= all.size())
    throw usage_error(fmt::format("a {} is out of range", what), where, fmt::format("{}", index),
                      fmt::format("below {}", all.size()));
  return all[static_cast<std::size_t>(index)];
}

struct Bytes {
  const unsigned char* data = nullptr;
  std::size_t size = 0;
};

Bytes view_bytes(const tinygltf::Model& model, int index, const std::string& where) {
  const auto& view = element(model.bufferViews, index, "buffer view", where);
  const auto& buffer = element(model.buffers, view.buffer, "buffer", where).data;
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset)
    throw usage_error(fmt::format("buffer view {} lies outside its buffer", index), where,
                      fmt::format("bytes {} and {} more", view.byteOffset, view.byteLength),
                      fmt::format("at most {}", buffer.size()));
  return {buffer.data() + view.byteOffset, view.byteLength};
}

double component(const unsigned char* at, int type, bool normalized) {
  const auto read = [&]<class T>(double scale) {
    T value;
    std::memcpy(&value, at, sizeof(T));
    return normalized ? std::max(static_cast<double>(value) / scale, -1.0) : static_cast<double>(value);
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return read.operator()<std::int8_t>(127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return read.operator()<std::uint8_t>(255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return read.operator()<std::int16_t>(32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return read.operator()<std::uint16_t>(65535);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return read.operator()<std::uint32_t>(4294967295.0);
    default:
      return read.operator()<float>(1);
  }
}

// Values of an accessor, `width` per element, checked against its view before any is read.
std::vector<double> accessor_values(const tinygltf::Model& model, int index, int width, const std::string& where) {
  const auto& accessor = element(model.accessors, index, "accessor", where);
  const std::string name = fmt::format("accessor {}", index);
  if (accessor.sparse.isSparse) throw usage_error(name + " is sparse, which is not read", where);
  if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != width)
    throw usage_error(name + " has the wrong type", where, fmt::format("type {}", accessor.type),
                      fmt::format("{} components", width));
  const int size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  if (size < 1 || size > 4)
    throw usage_error(name + " has a component type that is not read", where,
                      fmt::format("{}", accessor.componentType));
  const Bytes view = view_bytes(model, accessor.bufferView, where);
  const std::size_t packed = static_cast<std::size_t>(size) * width;
  const std::size_t declared = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride;
  const std::size_t stride = declared == 0 ? packed : declared;
  const bool fits = accessor.count > 0 && accessor.byteOffset <= view.size &&
                    packed <= view.size - accessor.byteOffset &&
                    (accessor.count - 1) <= (view.size - accessor.byteOffset - packed) / stride;
  if (!fits)
    throw usage_error(name + " lies outside its buffer view", where, fmt::format("{} elements", accessor.count),
                      fmt::format("what fits into {} bytes", view.size));
  std::vector<double> values(accessor.count * width);
  for (std::size_t i = 0; i < accessor.count; ++i)
    for (int c = 0; c < width; ++c)
      values[i * width + c] =
          component(view.data + accessor.byteOffset + i * stride + static_cast<std::size_t>(c) * size,
                    accessor.componentType, accessor.normalized);
  return values;
}

// One primitive before it joins the mesh: its own vertices and corners.
struct Part {
  std::vector<double> positions, normals, uvs;
  std::vector<std::uint32_t> corners;
  std::size_t vertices() const { return positions.size() / 3; }
};

std::vector<double> draco_values(const draco::Mesh& mesh, const draco::PointAttribute& attribute, int width,
                                 const std::string& where) {
  std::vector<double> values(static_cast<std::size_t>(mesh.num_points()) * width);
  std::array<float, 4> point{};
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    if (!attribute.ConvertValue<float>(attribute.mapped_index(i), static_cast<std::int8_t>(width), point.data()))
      throw usage_error("the Draco stream points outside its data", where);
    std::copy_n(point.begin(), width, values.begin() + static_cast<std::ptrdiff_t>(i.value()) * width);
  }
  return values;
}

Part read_draco(const tinygltf::Model& model, const tinygltf::Value& extension, const std::string& where) {
  if (!extension.Has("bufferView") || !extension.Get("bufferView").IsInt() || !extension.Has("attributes"))
    throw usage_error("the Draco extension lacks bufferView or attributes", where);
  const Bytes view = view_bytes(model, extension.Get("bufferView").Get<int>(), where);
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(view.data), view.size);
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) throw usage_error("the Draco stream is damaged: " + decoded.status().error_msg_string(), where);
  const draco::Mesh& mesh = *decoded.value();

  Part part;
  const auto take = [&](const char* name, int width) -> std::vector<double> {
    const tinygltf::Value& id = extension.Get("attributes").Get(name);
    if (!id.IsInt()) return {};
    const auto* attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id.Get<int>()));
    if (attribute == nullptr || attribute->num_components() != width)
      throw usage_error(fmt::format("the Draco stream has no {} of {} components", name, width), where);
    return draco_values(mesh, *attribute, width, where);
  };
  part.positions = take("POSITION", 3), part.normals = take("NORMAL", 3), part.uvs = take("TEXCOORD_0", 2);
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh.face(f)) part.corners.push_back(corner.value());
  return part;
}

// Triangles of a strip or fan, in the winding of its first.
std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& list, int mode, const std::string& where) {
  if (mode == TINYGLTF_MODE_TRIANGLES || mode == -1) {
    if (list.size() % 3 != 0)
      throw usage_error("the corners of a primitive are no triangles", where, fmt::format("{}", list.size()),
                        "a multiple of 3");
    return list;
  }
  if (mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN)
    throw usage_error("a primitive is no surface", where, fmt::format("mode {}", mode), "triangles, a strip or a fan");
  std::vector<std::uint32_t> out;
  for (std::size_t i = 2; i < list.size(); ++i) {
    if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
      out.insert(out.end(), {list[0], list[i - 1], list[i]});
    else if (i % 2 == 0)
      out.insert(out.end(), {list[i - 2], list[i - 1], list[i]});
    else
      out.insert(out.end(), {list[i - 1], list[i - 2], list[i]});
  }
  return out;
}

Part read_part(const tinygltf::Model& model, const tinygltf::Primitive& primitive, const std::string& where) {
  const auto extension = primitive.extensions.find(draco_name);
  if (extension != primitive.extensions.end()) return read_draco(model, extension->second, where);
  Part part;
  const auto take = [&](const char* name, int width) -> std::vector<double> {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? std::vector<double>{}
                                               : accessor_values(model, found->second, width, where);
  };
  part.positions = take("POSITION", 3), part.normals = take("NORMAL", 3), part.uvs = take("TEXCOORD_0", 2);
  if (part.vertices() == 0) throw usage_error("a primitive has no POSITION", where);
  std::vector<std::uint32_t> list(part.vertices());
  for (std::size_t i = 0; i < list.size(); ++i) list[i] = static_cast<std::uint32_t>(i);
  if (primitive.indices >= 0) {
    const std::vector<double> indices = accessor_values(model, primitive.indices, 1, where);
    list.assign(indices.size(), 0);
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (!(indices[i] >= 0 && indices[i] < static_cast<double>(part.vertices())))
        throw usage_error("an index is out of range", where, fmt::format("{}", indices[i]),
                          fmt::format("below {}", part.vertices()));
      list[i] = static_cast<std::uint32_t>(indices[i]);
    }
  }
  part.corners = triangles(list, primitive.mode, where);
  return part;
}

void check_part(const Part& part, const std::string& where) {
  if (part.vertices() == 0) throw usage_error("a primitive has no POSITION", where);
  const auto wrong = std::ranges::find_if_not(part.positions, [](double v) { return std::isfinite(v); });
  if (wrong != part.positions.end())
    throw usage_error("a position is not finite", where,
                      fmt::format("{} in vertex {}", *wrong, (wrong - part.positions.begin()) / 3), "finite numbers");
  const auto matches = [&](const std::vector<double>& values, std::size_t width) {
    return values.empty() || values.size() == part.vertices() * width;
  };
  if (!matches(part.normals, 3) || !matches(part.uvs, 2))
    throw usage_error("the attributes of a primitive have unlike lengths", where);
  for (std::uint32_t corner : part.corners)
    if (corner >= part.vertices())
      throw usage_error("an index is out of range", where, fmt::format("{}", corner),
                        fmt::format("below {}", part.vertices()));
}

// Normals weighted by area, for the vertices that have none; a vertex of no proper triangle gets +y.
void complete_normals(const Part& part, std::vector<Vec3>& normals, const std::vector<Vec3>& positions) {
  std::vector<Vec3> sums(positions.size(), Vec3(0));
  for (std::size_t i = 0; i + 2 < part.corners.size(); i += 3) {
    const std::uint32_t* c = &part.corners[i];
    const Vec3 area = glm::cross(positions[c[1]] - positions[c[0]], positions[c[2]] - positions[c[0]]);
    for (int k = 0; k < 3; ++k) sums[c[k]] += area;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!(glm::length(normals[i]) > 0) || !std::isfinite(glm::length(normals[i]))) normals[i] = sums[i];
    const double length = glm::length(normals[i]);
    normals[i] = length > 0 ? normals[i] / length : Vec3(0, 1, 0);
  }
}

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

void append(Mesh& mesh, Part part, const Mat4& transform, const std::string& where) {
  check_part(part, where);
  if (part.vertices() > max_vertices - mesh.positions.size() ||
      part.corners.size() > max_corners - 3 * mesh.indices.size())
    throw usage_error("the mesh is too large", where, {},
                      fmt::format("at most {} vertices and {} triangles", max_vertices, max_corners / 3));
  const Mat3 linear(transform);
  const double determinant = glm::determinant(linear);
  if (!std::isfinite(determinant) || determinant == 0)
    throw usage_error("the transform of a node is singular", where, fmt::format("determinant {}", determinant));
  if (determinant < 0)  // a mirror turns triangles inside out
    for (std::size_t i = 0; i + 2 < part.corners.size(); i += 3) std::swap(part.corners[i + 1], part.corners[i + 2]);
  const Mat3 to_normal = glm::transpose(glm::inverse(linear)) * std::abs(determinant);

  std::vector<Vec3> positions(part.vertices()), normals(part.vertices(), Vec3(0));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    positions[i] = Vec3(transform * glm::dvec4(glm::make_vec3(&part.positions[3 * i]), 1));
    if (!part.normals.empty()) normals[i] = to_normal * glm::make_vec3(&part.normals[3 * i]);
  }
  complete_normals(part, normals, positions);

  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  if (!part.uvs.empty()) mesh.uvs.resize(first, {0, 0});  // those of earlier primitives that had none
  for (std::size_t i = 0; i < positions.size(); ++i) {
    mesh.positions.push_back(floats(positions[i]));
    mesh.normals.push_back(floats(normals[i]));
    if (!part.uvs.empty())
      mesh.uvs.push_back({static_cast<float>(part.uvs[2 * i]), static_cast<float>(part.uvs[2 * i + 1])});
  }
  if (!mesh.uvs.empty()) mesh.uvs.resize(mesh.positions.size(), {0, 0});
  for (std::size_t i = 0; i + 2 < part.corners.size(); i += 3)
    mesh.indices.push_back({first + part.corners[i], first + part.corners[i + 1], first + part.corners[i + 2]});
}

Mat4 local_transform(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) return glm::make_mat4(node.matrix.data());
  Mat4 m(1);
  if (node.translation.size() == 3) m[3] = glm::dvec4(glm::make_vec3(node.translation.data()), 1);
  if (node.rotation.size() == 4) {
    const glm::dquat q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    m = m * glm::mat4_cast(glm::normalize(q));
  }
  if (node.scale.size() == 3)
    for (int i = 0; i < 3; ++i) m[i] *= node.scale[static_cast<std::size_t>(i)];
  return m;
}

std::vector<int> root_nodes(const tinygltf::Model& model, const std::string& where) {
  if (!model.scenes.empty()) return element(model.scenes, std::max(model.defaultScene, 0), "scene", where).nodes;
  std::vector<int> roots;  // without a scene: every node that is nobody's child
  for (int i = 0; i < static_cast<int>(model.nodes.size()); ++i) {
    const bool child = std::any_of(model.nodes.begin(), model.nodes.end(), [&](const tinygltf::Node& n) {
      return std::find(n.children.begin(), n.children.end(), i) != n.children.end();
    });
    if (!child) roots.push_back(i);
  }
  return roots;
}

Mesh assemble(const tinygltf::Model& model, const std::string& where) {
  struct Visit {
    int node;
    Mat4 transform;  // of the parent
  };
  std::vector<Visit> stack;
  const std::vector<int> roots = root_nodes(model, where);
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) stack.push_back({*root, Mat4(1)});
  std::vector<bool> seen(model.nodes.size(), false);
  Mesh mesh;
  while (!stack.empty()) {
    const auto [index, parent] = stack.back();
    stack.pop_back();
    const tinygltf::Node& node = element(model.nodes, index, "node", where);
    if (seen[static_cast<std::size_t>(index)])
      throw usage_error("a node has two parents or is its own ancestor", where, fmt::format("node {}", index));
    seen[static_cast<std::size_t>(index)] = true;
    const Mat4 transform = parent * local_transform(node);
    if (node.mesh >= 0)
      for (const tinygltf::Primitive& primitive : element(model.meshes, node.mesh, "mesh", where).primitives)
        append(mesh, read_part(model, primitive, where), transform, where);
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
      stack.push_back({*child, transform});
  }
  if (mesh.indices.empty()) throw usage_error("holds no triangle", where);
  return mesh;
}

}  // namespace

Extent bounds(const Mesh& mesh) {
  if (mesh.positions.empty()) return {};
  Extent box{mesh.positions[0], mesh.positions[0]};
  for (const auto& p : mesh.positions)
    for (std::size_t i = 0; i < 3; ++i)
      box.low[i] = std::min(box.low[i], p[i]), box.high[i] = std::max(box.high[i], p[i]);
  return box;
}

Mesh read_mesh(const std::filesystem::path& path) {
  try {
    return assemble(load_model(path), path.string());
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // of the libraries, on input their checks let through
    throw usage_error(std::string("is no valid glTF: ") + error.what(), path.string());
  }
}

}  // namespace clerestory
