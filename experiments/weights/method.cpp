#include "experiments/weights/method.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/data_files.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr const char *kZhu = "zhu", *kLi = "li2020";
constexpr const char* kFiles = "maps.safetensors, light_local.safetensors and light_global.safetensors";

std::string name_of(bool of_li) { return of_li ? kLi : kZhu; }

/// What the weights say they are; of `name`, unless it is empty, and both of one method.
Method told_by(const fs::path& maps, const fs::path& light, std::string name) {
  const auto require = [&name](const fs::path& file, bool of_li) {
    if (name.empty()) name = name_of(of_li);
    if (name_of(of_li) != name)
      throw usage_error("weights of another method", file.string() + ": net", name_of(of_li), name);
  };
  const LightSizes sizes = read_light_sizes(light);
  require(weights_files(light)[0], sizes.li2020.has_value());
  require(maps, read_maps_size(maps).li2020());
  return {name, light_of(sizes), maps, light};
}

Method of_folder(const fs::path& folder, const std::string& name) {
  const fs::path maps = folder / "maps.safetensors";
  std::vector<fs::path> files = weights_files(folder);
  files.insert(files.begin(), maps);
  for (const fs::path& file : files)
    if (!fs::exists(file))
      throw usage_error("the folder of a method lacks weights", file.string(), "no such file", kFiles);
  return told_by(maps, folder, name);
}

/// Where weights lie that do not come with the program.
fs::path folder_of(const std::string& name, const std::string& option) {
  const std::vector<fs::path> places = data_places(fs::path("nets/weights") / name);
  const auto found = std::ranges::find_if(places, [](const fs::path& place) { return fs::is_directory(place); });
  if (found != places.end()) return *found;
  throw usage_error(
      fmt::format("no weights of {0} come with the program; `clerestory train` makes them by "
                  "experiments/configs/{0}_maps.toml and {0}_light.toml, `clerestory weights export` puts them there",
                  name),
      option + " " + name + ": " + text_of(places), "no such folder",
      std::string(kFiles) + ", or their folder by its path");
}

}  // namespace

Method find_method(const std::string& name_or_folder, const std::string& option) {
  if (name_or_folder == kZhu) return told_by(shipped_weights(), light_or_shipped({}), kZhu);
  if (name_or_folder == kLi) return of_folder(folder_of(kLi, option), kLi);
  if (fs::is_directory(name_or_folder)) return of_folder(name_or_folder, {});
  throw usage_error("there is no such method or folder", option, name_or_folder,
                    fmt::format("{}, {} or a folder of {}", kZhu, kLi, kFiles));
}

}  // namespace clerestory
