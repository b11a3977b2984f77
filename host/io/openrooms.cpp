#include "host/io/openrooms.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <tuple>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

fs::path file_of(const OpenRoomsName& name, const char* what, const char* extension) {
  return name.root / name.kind / name.scene / fmt::format("{}_{}.{}", what, name.number, extension);
}

/// The same view of the kind whose name lacks a word; the view itself where the file is there.
fs::path shared_file(const OpenRoomsName& name, const char* what, const char* extension,
                     std::initializer_list<const char*> words) {
  fs::path file = file_of(name, what, extension);
  OpenRoomsName other = name;
  for (const char* word : words)
    if (const std::size_t at = other.kind.find(word); at != std::string::npos) other.kind.erase(at, std::strlen(word));
  return fs::exists(file) ? file : file_of(other, what, extension);
}

std::string size_text(const Image& image) { return fmt::format("{}x{}", image.width, image.height); }

/// Of one channel, or of several alike.
Image first_channel(Image image) {
  image.data.resize(image.pixels());
  image.channels = 1;
  return image;
}

void check_size(const Image& image, const Image& first, const fs::path& file) {
  if (image.width != first.width || image.height != first.height)
    throw usage_error("is of another size than the picture", file.string(), size_text(image), size_text(first));
}

Image read_depth(const fs::path& file) {
  const std::string bytes = read_file(file, std::uint64_t{1} << 30);
  std::int32_t sides[2] = {};  // height, width
  if (bytes.size() < sizeof sides) throw usage_error("ends too early", file.string());
  std::memcpy(sides, bytes.data(), sizeof sides);
  const auto expected = [&] { return sizeof sides + 4ull * static_cast<std::uint64_t>(sides[0]) * sides[1]; };
  if (sides[0] < 1 || sides[1] < 1 || sides[0] > 65535 || sides[1] > 65535 || bytes.size() != expected())
    throw usage_error("the size it states is not its own", file.string(),
                      fmt::format("{}x{} in {} bytes", sides[1], sides[0], bytes.size()),
                      "height, width, and four bytes for each pixel");
  Image depth(sides[1], sides[0], 1);
  std::memcpy(depth.data.data(), bytes.data() + sizeof sides, 4 * depth.data.size());
  for (float& d : depth.data)
    if (!(d > 0) || !std::isfinite(d)) d = 0;
  return depth;
}

Image read_tiles(const fs::path& file, const Image& picture) {
  Image light = read_map(file, 3);
  const int width = picture.width / openrooms_stride * openrooms_azimuths,
            height = picture.height / openrooms_stride * openrooms_elevations;
  if (light.width != width || light.height != height)
    throw usage_error("tiles of a wrong size", file.string(), size_text(light),
                      fmt::format("{}x{}: tiles of {}x{} for every fourth pixel of {}", width, height,
                                  openrooms_azimuths, openrooms_elevations, size_text(picture)));
  check_radiance(light, file);
  return light;
}

void make_unit(Image& normal) {
  for (std::size_t i = 0; i < normal.pixels(); ++i) {
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += std::pow(normal.plane(c)[i], 2.0);
    for (int c = 0; c < 3 && squares > 0; ++c)
      normal.plane(c)[i] = static_cast<float>(normal.plane(c)[i] / std::sqrt(squares));
  }
}

/// Radiance HDR, each pixel by itself: three mantissas and their exponent.
std::string encode_hdr(const Image& image) {
  std::string bytes = fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", image.height, image.width);
  for (std::size_t i = 0; i < image.pixels(); ++i) {
    const float v[3] = {image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]};
    const float most = std::max({v[0], v[1], v[2]});
    int exponent = 0;
    std::frexp(most, &exponent);
    for (const float channel : v)
      bytes += static_cast<char>(most < 1e-32f ? 0 : static_cast<int>(std::ldexp(channel, 8 - exponent)));
    bytes += static_cast<char>(most < 1e-32f ? 0 : exponent + 128);
  }
  return bytes;
}

}  // namespace

OpenRoomsView read_openrooms(const OpenRoomsName& name) {
  OpenRoomsView view;
  const fs::path picture = file_of(name, "im", "hdr");
  view.image = read_map(picture, 3);
  check_radiance(view.image, picture);
  const auto read = [&](const fs::path& file, int channels) {
    Image map = channels == 3 ? read_map(file, 3) : first_channel(read_image(file));
    check_size(map, view.image, file);
    return map;
  };
  view.albedo = read(file_of(name, "imbaseColor", "png"), 3);
  for (float& v : view.albedo.data) v = std::pow(v, 2.2f);
  view.normal = read(shared_file(name, "imnormal", "png", {"DiffLight"}), 3);
  for (float& v : view.normal.data) v = 2 * v - 1;
  make_unit(view.normal);
  view.roughness = read(file_of(name, "imroughness", "png"), 1);
  view.mask = read(shared_file(name, "immask", "png", {"DiffMat"}), 1);
  for (float& v : view.mask.data) v = std::round(2 * v) / 2;
  const fs::path depth = shared_file(name, "imdepth", "dat", {"DiffLight", "DiffMat"});
  view.depth = read_depth(depth);
  check_size(view.depth, view.image, depth);
  if (const fs::path light = file_of(name, "imenv", "hdr"); fs::exists(light))
    view.light = read_tiles(light, view.image);
  return view;
}

bool is_openrooms(const fs::path& root) {
  std::error_code code;
  for (fs::directory_iterator entry(root, code), end; !code && entry != end; entry.increment(code))
    if (entry->is_directory() && entry->path().filename().string().starts_with("main") &&
        entry->path().filename().string().find("_xml") != std::string::npos)
      return true;
  return false;
}

namespace {

/// N of im_N.hdr; 0 of any other name.
int number_of(const std::string& file) {
  int number = 0;
  if (!file.starts_with("im_") || !file.ends_with(".hdr") || file.size() < 8) return 0;
  const char* end = file.data() + file.size() - 4;
  const auto [rest, error] = std::from_chars(file.data() + 3, end, number);
  return error == std::errc() && rest == end && number > 0 ? number : 0;
}

void add_views(std::vector<OpenRoomsName>& all, const fs::path& root, const std::string& kind,
               const std::string& scene) {
  std::error_code none;  // a kind need not have every scene
  for (fs::directory_iterator entry(root / kind / scene, none), end; !none && entry != end; entry.increment(none))
    if (const int number = number_of(entry->path().filename().string())) all.push_back({root, kind, scene, number});
}

}  // namespace

std::vector<OpenRoomsName> list_openrooms(const fs::path& root, const std::string& split) {
  std::istringstream lines(read_file(root / (split + ".txt"), std::uint64_t{1} << 26));
  std::vector<OpenRoomsName> all;
  for (std::string scene; std::getline(lines, scene);) {
    scene.resize(scene.find_last_not_of(" \t\r") + 1);
    if (scene.empty()) continue;
    if (scene == "." || scene == ".." || scene.find('/') != std::string::npos)
      throw usage_error("is no name of a scene", (root / (split + ".txt")).string(), scene);
    for (const auto& kind : fs::directory_iterator(root))
      if (kind.is_directory()) add_views(all, root, kind.path().filename().string(), scene);
  }
  if (all.empty())
    throw usage_error("there is no view", root.string(), "no im_N.hdr of a scene of " + split + ".txt",
                      "<kind>/<scene>/im_N.hdr");
  std::ranges::sort(all, [](const OpenRoomsName& a, const OpenRoomsName& b) {
    return std::tie(a.kind, a.scene, a.number) < std::tie(b.kind, b.scene, b.number);
  });
  return all;
}

void write_openrooms(const OpenRoomsName& name, const OpenRoomsView& view) {
  make_directories(name.root / name.kind / name.scene);
  Image normal = view.normal;
  for (float& v : normal.data) v = 0.5f + 0.5f * v;
  write_png(file_of(name, "imbaseColor", "png"), view.albedo, Encoding::Gamma);
  write_png(file_of(name, "imnormal", "png"), normal, Encoding::Linear);
  write_png(file_of(name, "imroughness", "png"), view.roughness, Encoding::Linear);
  write_png(file_of(name, "immask", "png"), view.mask, Encoding::Linear);
  const std::int32_t sides[2] = {view.depth.height, view.depth.width};
  std::string bytes(sizeof sides + 4 * view.depth.data.size(), '\0');
  std::memcpy(bytes.data(), sides, sizeof sides);
  std::memcpy(bytes.data() + sizeof sides, view.depth.data.data(), 4 * view.depth.data.size());
  write_file(file_of(name, "imdepth", "dat"), bytes);
  if (view.light) write_file(file_of(name, "imenv", "hdr"), encode_hdr(*view.light));
  write_file(file_of(name, "im", "hdr"), encode_hdr(view.image));
}

}  // namespace clerestory
