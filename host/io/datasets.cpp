// Rooms in InteriorVerse's layout, and RGB-D frames. G-buffers are in gbuffer.cpp.
#include "host/io/datasets.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "host/error.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

// Depth and mask have one channel, which some copies of the data set repeat in three.
Image read_single(const fs::path& path) {
  Image image = read_image(path);
  if (image.channels == 1) return image;
  if (image.channels != 3)
    throw usage_error("wrong channels", path.string(), fmt::format("{}", image.channels), "1, or 3 alike");
  image.data.resize(image.pixels());
  image.channels = 1;
  return image;
}

void check_size(const Image& image, const Image& first, const fs::path& path) {
  if (image.width != first.width || image.height != first.height)
    throw usage_error("the maps have unlike sizes", path.string(), fmt::format("{}x{}", image.width, image.height),
                      fmt::format("{}x{}", first.width, first.height));
}

bool all_finite(const Image& image, std::size_t pixel) {
  for (int c = 0; c < image.channels; ++c)
    if (!std::isfinite(image.plane(c)[pixel])) return false;
  return true;
}

void set_pixel(Image& image, std::size_t pixel, float value) {
  for (int c = 0; c < image.channels; ++c) image.plane(c)[pixel] = value;
}

double length(const Image& normal, std::size_t pixel) {
  double squares = 0;
  for (int c = 0; c < 3; ++c) squares += std::pow(normal.plane(c)[pixel], 2.0);
  return std::sqrt(squares);
}

// The data set's own flaws (holes, NaN, normals of no length) become mask 0 and zeros; normals get unit length.
UnfilledPixels clean(RoomView& view) {
  UnfilledPixels unfilled;
  for (std::size_t i = 0; i < view.mask.pixels(); ++i) {
    const bool masked = view.mask.data[i] > 0.5f;
    bool valid = masked;
    const auto require = [&](Image& image, std::size_t& count, bool good) {
      if (good) return;
      count += masked ? 1 : 0;
      set_pixel(image, i, 0);
      valid = false;
    };
    if (view.depth.channels)
      require(view.depth, unfilled.depth, view.depth.data[i] > 0 && std::isfinite(view.depth.data[i]));
    if (view.normal.channels) {
      const double l = length(view.normal, i);
      require(view.normal, unfilled.normal, std::isfinite(l) && l > 0);
      if (masked && std::isfinite(l) && l > 0 && std::abs(l - 1) > 0.01) ++unfilled.normal_length;
      if (std::isfinite(l) && l > 0)
        for (int c = 0; c < 3; ++c) view.normal.plane(c)[i] = static_cast<float>(view.normal.plane(c)[i] / l);
    }
    if (view.albedo.channels) require(view.albedo, unfilled.albedo, all_finite(view.albedo, i));
    if (view.material.channels) require(view.material, unfilled.material, all_finite(view.material, i));
    view.mask.data[i] = valid ? 1 : 0;
  }
  return unfilled;
}

void check_to_write(const Image& image, int channels, const Image& first, const fs::path& path) {
  if (image.channels != channels || image.width != first.width || image.height != first.height)
    throw Error(ErrorKind::Failed, "wrong size of a map to write", path.string(),
                fmt::format("{}x{}x{}", image.width, image.height, image.channels),
                fmt::format("{}x{}x{}", first.width, first.height, channels));
  for (std::size_t i = 0; i < image.pixels(); ++i)
    if (!all_finite(image, i))
      throw Error(ErrorKind::Failed, "a value to write is not finite", path.string(),
                  fmt::format("pixel ({}, {})", i % image.width, i / image.width));
}

std::string trimmed(std::string line) {
  const auto end = line.find_last_not_of(" \t\r");
  line.resize(end == std::string::npos ? 0 : end + 1);
  return line;
}

}  // namespace

std::vector<std::string> list_rooms(const fs::path& root, const std::string& split,
                                    const std::function<void(const Error&)>& bad) {
  const fs::path list = root / (split + ".txt");
  if (!fs::exists(list))
    throw usage_error("there is no such list of rooms", list.string(),
                      fs::is_directory(root) ? "a folder without it" : "no folder",
                      "a data set: a folder with " + split + ".txt and its rooms, as `clerestory generate` writes it");
  std::istringstream lines(read_file(list, std::uint64_t{1} << 28, true));
  std::vector<std::string> rooms;
  std::set<std::string> seen;
  int number = 0;
  std::error_code no_folder;  // also of a name that is too long for one
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line = trimmed(std::move(line));
    if (line.empty()) continue;
    const char* fault = nullptr;
    if (line == "." || line == ".." || line.find('/') != std::string::npos || line.find('\0') != std::string::npos)
      fault = "is no name of a room";
    else if (!seen.insert(line).second)
      fault = "the room is listed twice";
    else if (!fs::is_directory(root / line, no_folder))
      fault = "the room has no folder";
    if (fault == nullptr) {
      rooms.push_back(line);
      continue;
    }
    const Error error = usage_error(fault, fmt::format("{}:{}", list.string(), number), line);
    if (!bad) throw error;
    bad(error);
  }
  return rooms;
}

void write_rooms(const fs::path& root, const std::string& split, const std::vector<std::string>& rooms) {
  std::string text;
  for (const std::string& room : rooms) text += room + "\n";
  write_file(root / (split + ".txt"), text);
}

std::vector<std::string> list_views(const fs::path& room, const std::vector<std::string>& maps) {
  std::error_code code;
  fs::directory_iterator entries(room, code);
  if (code) throw usage_error("the room cannot be read: " + code.message(), room.string());
  std::set<std::string> views;
  for (const auto& entry : entries) {
    const std::string name = entry.path().filename().string();
    for (const std::string& map : maps)
      if (const std::string ending = "_" + map + ".exr";
          name.size() > ending.size() && name.ends_with(ending) && name[0] != '.')
        views.insert(name.substr(0, name.size() - ending.size()));
  }
  return {views.begin(), views.end()};
}

std::string view_id(int number) { return fmt::format("{:03}", number); }

fs::path view_file(const fs::path& room, const std::string& id, const std::string& what, const std::string& extension) {
  return room / fmt::format("{}_{}.{}", id, what, extension);
}

void millimetres_to_metres(Image& depth) {
  for (float& d : depth.data) d = d > 0 && std::isfinite(d) ? d / 1000 : 0;
}

void metres_to_millimetres(Image& depth) {
  for (float& d : depth.data) d = d > 0 && std::isfinite(d) ? d * 1000 : std::numeric_limits<float>::infinity();
}

RoomView read_view(const fs::path& room, const std::string& id, const ViewParts& parts, UnfilledPixels* unfilled) {
  RoomView view;
  const Image* first = nullptr;
  const auto read = [&](Image& to, const char* what, bool wanted, int channels) {
    if (!wanted) return;
    const fs::path path = view_file(room, id, what);
    to = channels == 1 ? read_single(path) : read_map(path, channels);
    if (first == nullptr) first = &to;
    check_size(to, *first, path);
  };
  read(view.image, "im", parts.image, 3);
  read(view.albedo, "albedo", parts.albedo, 3);
  read(view.depth, "depth", parts.depth, 1);
  read(view.material, "material", parts.material, 3);
  read(view.normal, "normal", parts.normal, 3);
  read(view.mask, "mask", parts.mask, 1);
  if (parts.emission && fs::exists(view_file(room, id, "emission"))) read(view.emission.emplace(), "emission", true, 3);
  if (first == nullptr) throw usage_error("nothing of the view is asked for", (room / id).string());

  if (!parts.mask) view.mask = Image(first->width, first->height, 1, 1);
  if (parts.image) check_radiance(view.image, view_file(room, id, "im"));
  if (view.emission) check_radiance(*view.emission, view_file(room, id, "emission"));
  if (parts.depth) millimetres_to_metres(view.depth);
  const UnfilledPixels found = clean(view);
  if (unfilled != nullptr) *unfilled = found;

  const fs::path camera = view_file(room, id, "camera", "json");
  if (parts.camera && fs::exists(camera)) {
    const CameraFile file = read_camera(camera);
    if (file.camera.width != first->width || file.camera.height != first->height)
      throw usage_error("the camera is of another size than the view", camera.string(),
                        fmt::format("{}x{}", file.camera.width, file.camera.height),
                        fmt::format("{}x{}", first->width, first->height));
    view.camera = file.camera;
    view.exposure = file.exposure.value_or(1);
  }
  return view;
}

RoomView read_view(const fs::path& room_and_id, const ViewParts& parts) {
  return read_view(room_and_id.parent_path(), room_and_id.filename().string(), parts);
}

bool is_view(const fs::path& room_and_id) {
  const fs::path room = room_and_id.parent_path();
  const std::string id = room_and_id.filename().string();
  if (id.empty() || fs::is_directory(room_and_id)) return false;
  return fs::exists(view_file(room, id, "im")) || fs::exists(view_file(room, id, "depth"));
}

void write_view(const fs::path& room, const std::string& id, const RoomView& view) {
  const Image& first = view.image;
  const auto write = [&](const Image& image, const char* what, int channels, ExrType type) {
    const fs::path path = view_file(room, id, what);
    check_to_write(image, channels, first, path);
    write_exr(path, image, type == ExrType::Half && !fits_half(image) ? ExrType::Float : type);
  };
  make_directories(room);
  write(view.mask, "mask", 1, ExrType::Half);
  write(view.albedo, "albedo", 3, ExrType::Half);
  write(view.material, "material", 3, ExrType::Half);
  write(view.normal, "normal", 3, ExrType::Float);
  check_to_write(view.depth, 1, first, view_file(room, id, "depth"));
  Image depth = view.depth;
  metres_to_millimetres(depth);
  write_exr(view_file(room, id, "depth"), depth, ExrType::Float);
  if (view.emission) write(*view.emission, "emission", 3, ExrType::Half);
  if (view.camera) write_camera(view_file(room, id, "camera", "json"), *view.camera, view.exposure);
  write(view.image, "im", 3, ExrType::Half);
}

RgbdFrame read_rgbd(const fs::path& named) {
  const fs::path folder = found_data(named);
  RgbdFrame frame;
  const auto is_there = [&](const char* name) { return fs::exists(folder / name); };
  const char* picture = nullptr;
  for (const char* name : {"rgb.png", "rgb.jpg", "left.png"})
    if (picture == nullptr && is_there(name)) picture = name;
  if (picture == nullptr) throw usage_error("holds no picture", folder.string(), {}, "rgb.png, rgb.jpg or left.png");
  frame.photo = read_photo(folder / picture);
  frame.depth = read_map(folder / "depth.exr", 1);
  check_size(frame.depth, frame.photo.image, folder / "depth.exr");
  for (std::size_t i = 0; i < frame.depth.pixels(); ++i)
    if (!std::isfinite(frame.depth.data[i]) || frame.depth.data[i] < 0)
      throw usage_error(
          "a depth is wrong", (folder / "depth.exr").string(),
          fmt::format("{} at ({}, {})", frame.depth.data[i], i % frame.depth.width, i / frame.depth.width),
          "metres, 0 for none");
  frame.camera = read_camera(folder / "camera.json");
  if (frame.camera.camera.width != frame.depth.width || frame.camera.camera.height != frame.depth.height)
    throw usage_error("the camera is of another size than the picture", (folder / "camera.json").string(),
                      fmt::format("{}x{}", frame.camera.camera.width, frame.camera.camera.height),
                      fmt::format("{}x{}", frame.depth.width, frame.depth.height));
  if (is_there("right.png")) {
    frame.right = read_photo(folder / "right.png").image;
    check_size(*frame.right, frame.photo.image, folder / "right.png");
  }
  return frame;
}

}  // namespace clerestory
