// Maps handed to `invert --gbuffer`: a run folder's or a generated view's.
#include <cmath>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/finite.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr float rounding = 1e-3f;  // by which a map in [0, 1] may leave it: half precision and other programs' rounding

std::string pixel_of(const Image& image, std::size_t i) {
  return fmt::format("pixel ({}, {})", i % image.width, i / image.width);
}

void clamp_unit(Image& image, int channel, const fs::path& path) {
  float* plane = image.plane(channel);
  for (std::size_t i = 0; i < image.pixels(); ++i) {
    if (plane[i] < -rounding || plane[i] > 1 + rounding)
      throw usage_error("a value is out of range", path.string(),
                        fmt::format("{} at channel {}, {}", plane[i], channel, pixel_of(image, i)), "0 to 1");
    plane[i] = std::min(std::max(plane[i], 0.0f), 1.0f);
  }
}

void check_depth(const Image& depth, const fs::path& path) {
  for (std::size_t i = 0; i < depth.pixels(); ++i)
    if (depth.data[i] < 0)
      throw usage_error("a depth is negative", path.string(),
                        fmt::format("{} at {}", depth.data[i], pixel_of(depth, i)), "metres, 0 for none");
}

// Unit length, or zero where there is no normal. A map of [0, 1] colours or of another scale shows in the lengths.
void check_normal(Image& normal, const fs::path& path) {
  std::size_t odd = 0, some = 0;
  for (std::size_t i = 0; i < normal.pixels(); ++i) {
    float *x = normal.plane(0) + i, *y = normal.plane(1) + i, *z = normal.plane(2) + i;
    const float length = std::hypot(*x, *y, *z);
    if (length == 0) continue;
    ++some;
    odd += std::abs(length - 1) > 0.1f;
    *x /= length, *y /= length, *z /= length;
  }
  if (odd > some / 10)
    throw usage_error("the normals are not unit vectors", path.string(),
                      fmt::format("{} of {} are off by over 0.1", odd, some),
                      "camera space, each component in [-1, 1]");
}

class FolderReader {
 public:
  explicit FolderReader(const fs::path& folder) : folder_(folder) {}

  template <class Check>
  void read(std::optional<Image>& to, const char* name, int channels, const Check& check) {
    const fs::path path = folder_ / name;
    if (!fs::exists(path)) return;
    Image image = read_map(path, channels);
    if (width_ == 0) width_ = image.width, height_ = image.height;
    check_size(image.width, image.height, path);
    check_finite(image, path);
    check(image, path);
    to = std::move(image);
  }

  void check_size(int width, int height, const fs::path& path) const {
    if (width != width_ || height != height_)
      throw usage_error("is of another size than the other maps", path.string(), fmt::format("{}x{}", width, height),
                        fmt::format("{}x{}", width_, height_));
  }

 private:
  fs::path folder_;
  int width_ = 0, height_ = 0;
};

GBuffer read_folder(const fs::path& folder, bool camera) {
  GBuffer maps;
  FolderReader reader(folder);
  reader.read(maps.albedo, "albedo.exr", 3, [](Image& image, const fs::path& path) {
    for (int c = 0; c < 3; ++c) clamp_unit(image, c, path);
  });
  reader.read(maps.normal, "normal.exr", 3, check_normal);
  reader.read(maps.depth, "depth.exr", 1, check_depth);
  reader.read(maps.material, "material.exr", 3, [](Image& image, const fs::path& path) {
    for (int c = 0; c < 3; ++c) clamp_unit(image, c, path);
  });
  if (!maps.albedo && !maps.normal && !maps.depth && !maps.material)
    throw usage_error("holds no map", folder.string(), {}, "albedo.exr, normal.exr, depth.exr or material.exr");
  if (const fs::path path = folder / "camera.json"; camera && fs::exists(path)) {
    maps.camera = read_camera(path);
    reader.check_size(maps.camera->camera.width, maps.camera->camera.height, path);
  }
  return maps;
}

// In a view the third channel of the material means nothing; the emission flag comes from the emitted radiance.
GBuffer from_view(const fs::path& path, bool camera) {
  RoomView view = read_view(path, ViewParts{.image = false, .camera = camera});
  for (std::size_t i = 0; i < view.material.pixels(); ++i) {
    bool emits = false;
    for (int c = 0; view.emission && c < 3; ++c) emits = emits || view.emission->plane(c)[i] > 0;
    view.material.plane(2)[i] = emits ? 1 : 0;
  }
  const auto file = [&](const char* what) { return view_file(path.parent_path(), path.filename().string(), what); };
  for (int c = 0; c < 3; ++c) clamp_unit(view.albedo, c, file("albedo"));
  for (int c = 0; c < 2; ++c) clamp_unit(view.material, c, file("material"));
  GBuffer maps;
  maps.albedo = std::move(view.albedo), maps.normal = std::move(view.normal), maps.depth = std::move(view.depth);
  maps.material = std::move(view.material), maps.mask = std::move(view.mask);
  if (view.camera) {
    CameraFile& known = maps.camera.emplace();
    known.camera = *view.camera, known.has_pose = true;
  }
  return maps;
}

}  // namespace

GBuffer read_gbuffer(const fs::path& path, bool camera) {
  if (is_view(path)) return from_view(path, camera);
  if (fs::is_directory(path)) return read_folder(path, camera);
  throw usage_error("is neither a folder of maps nor a view", path.string(), {}, "a folder, or ROOM/NNN");
}

}  // namespace clerestory
