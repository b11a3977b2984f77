#include "host/io/light_files.hpp"

#include <cmath>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Names in the folder have two digits.
constexpr std::size_t kMostProbes = 100;

fs::path probe_file(const fs::path& room, const std::string& id, std::size_t number) {
  return view_file(room, id, fmt::format("probe_{:02}", number));
}

void check_light(const Image& image, int width, int height, const fs::path& path, ErrorKind kind) {
  if (image.width != width || image.height != height || image.channels != 3) {
    throw Error(kind, "wrong size of a file of light", path.string(),
                fmt::format("{}x{}, {} channels", image.width, image.height, image.channels),
                fmt::format("{}x{}, 3 channels", width, height));
  }
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    if (std::isfinite(image.data[i]) && image.data[i] >= 0) continue;
    throw Error(kind, "radiance is not a finite number of at least 0", path.string(),
                fmt::format("{} at {}", image.data[i], place_of(image, i)));
  }
}

Image read_light(const fs::path& path, int width, int height) {
  if (!fs::exists(path))
    throw usage_error("the view has no light", path.string(), "no such file",
                      "a data set with light: `clerestory generate` without --no-light");
  Image image = read_map(path, 3);
  check_light(image, width, height, path, ErrorKind::Usage);
  return image;
}

void write_light(const fs::path& path, const Image& image, int width, int height) {
  check_light(image, width, height, path, ErrorKind::Failed);
  write_exr(path, image, fits_half(image) ? ExrType::Half : ExrType::Float);
}

json read_list(const fs::path& path) {
  json list = parse_json(read_file(path, std::uint64_t{1} << 20), path.string());
  if (!list.is_array() || list.size() > kMostProbes)
    throw usage_error("wrong JSON", path.string(), brief(list), fmt::format("a list of at most {}", kMostProbes));
  return list;
}

/// A probe as the list has it, without its panorama.
Probe probe_of(const json& entry, const std::string& where) {
  if (!entry.is_object()) throw usage_error("wrong JSON", where, brief(entry), "an object");
  const auto wrong = [&](const char* key, const char* expected) {
    return usage_error(fmt::format("wrong value of {}", key), where,
                       entry.contains(key) ? brief(entry[key]) : "nothing", expected);
  };
  Probe probe;
  const json center = entry.value("center", json()), distance = entry.value("distance", json()),
             visible = entry.value("visible", json());
  if (!center.is_array() || center.size() != 3) throw wrong("center", "3 numbers");
  for (int c = 0; c < 3; ++c) {
    if (!center[static_cast<std::size_t>(c)].is_number()) throw wrong("center", "3 numbers");
    probe.center[c] = center[static_cast<std::size_t>(c)].get<double>();
  }
  if (!distance.is_number() || !(distance.get<double>() > 0)) throw wrong("distance", "metres above 0");
  if (!visible.is_boolean()) throw wrong("visible", "true or false");
  probe.distance = distance.get<double>(), probe.visible = visible.get<bool>();
  return probe;
}

}  // namespace

std::array<float, 3> Envmaps::at(int column, int row, int azimuth, int elevation) const {
  const int x = column * envmap_azimuths + azimuth, y = row * envmap_elevations + elevation;
  return {radiance.at(0, y, x), radiance.at(1, y, x), radiance.at(2, y, x)};
}

Envmaps read_envmaps(const fs::path& room, const std::string& id, int width, int height) {
  Envmaps envmaps;
  envmaps.layout = EnvmapLayout::of(width, height);
  envmaps.radiance =
      read_light(view_file(room, id, "envmap"), envmaps.layout.file_width(), envmaps.layout.file_height());
  return envmaps;
}

std::vector<Probe> read_probes(const fs::path& room, const std::string& id) {
  const fs::path list = view_file(room, id, "probes", "json");
  std::vector<Probe> probes;
  for (const json& entry : read_list(list)) {
    probes.push_back(probe_of(entry, fmt::format("{}[{}]", list.string(), probes.size())));
    probes.back().radiance = read_light(probe_file(room, id, probes.size() - 1), probe_width, probe_height);
  }
  return probes;
}

void write_envmaps(const fs::path& room, const std::string& id, const Envmaps& envmaps) {
  write_light(view_file(room, id, "envmap"), envmaps.radiance, envmaps.layout.file_width(),
              envmaps.layout.file_height());
}

void write_probes(const fs::path& room, const std::string& id, const std::vector<Probe>& probes) {
  const fs::path file = view_file(room, id, "probes", "json");
  if (probes.size() > kMostProbes)
    throw Error(ErrorKind::Failed, "too many probes", file.string(), std::to_string(probes.size()),
                fmt::format("at most {}", kMostProbes));
  json list = json::array();
  for (const Probe& probe : probes) {
    write_light(probe_file(room, id, list.size()), probe.radiance, probe_width, probe_height);
    list.push_back({{"center", {probe.center.x, probe.center.y, probe.center.z}},
                    {"distance", probe.distance},
                    {"visible", probe.visible}});
  }
  write_file(file, list.dump(2) + "\n");
}

}  // namespace clerestory
