#include "tracer/named_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/json_file.hpp"
#include "host/io/light_files.hpp"
#include "host/math/statistics.hpp"
#include "tracer/random.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using SayProblem = std::function<void(const fs::path&, const std::string&)>;

constexpr double kRounding = 0x1p-10;   // of a value in half: the most to its neighbour
constexpr double kOtherSurface = 1e-3;  // of the pixels
constexpr double kDeviations = 5;

/// What room_name and room_seed are to know of a split.
GenerateOptions naming_of(const SetSplit& split) {
  GenerateOptions naming;
  naming.rooms.seed = split.seed, naming.rooms.setting = split.setting;
  return naming;
}

template <class Each>
void for_each_room(const SetSplit& split, const RoomAssets& assets, const std::function<void(int)>& after,
                   Each&& each) {
  const GenerateOptions naming = naming_of(split);
  for (int index = 0; index < split.rooms; ++index) {
    const std::uint64_t seed = room_seed(naming, index);
    each(index, room_name(naming, index), seed, make_room(seed, split.setting, assets));
    if (after) after(index + 1);
  }
}

/// Of a map: its mean, and what rounding and edges may change.
MeanWithin mean_of(std::span<const float> values) {
  const auto n = static_cast<double>(values.size());
  double size = 0;
  for (const float v : values) size += std::abs(static_cast<double>(v));
  const auto [least, most] = std::ranges::minmax(values);
  return {sum(values) / n, kRounding * size / n + kOtherSurface * (static_cast<double>(most) - least)};
}

std::vector<float> luminances(const Image& image, double factor) {
  std::vector<float> all(image.pixels());
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = static_cast<float>(factor * luminance(image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]));
  return all;
}

/// Of samples: their mean, and what rounding and noise may change. `error`: the mean's standard deviation.
MeanWithin noisy_mean(const std::vector<float>& values, double error) {
  const double mean_value = mean(std::span(values));
  return {mean_value, kRounding * mean_value + kDeviations * std::sqrt(2.0) * error};
}

/// The standard deviation of a picture's mean luminance, from the variance of its pixels. Channels go together: that of
/// a pixel is at most the luminance of its channels' deviations.
double error_of_picture(Image variance, double factor) {
  for (float& v : variance.data) v = std::sqrt(v);
  double sum_of_squares = 0;
  for (const float v : luminances(variance, factor)) sum_of_squares += static_cast<double>(v) * static_cast<double>(v);
  return std::sqrt(sum_of_squares) / static_cast<double>(variance.pixels());
}

/// At most that of the mean of independent samples of which nothing else is known: their spread is at least their
/// noise.
double error_by_spread(const std::vector<float>& values) {
  return standard_deviation(std::span(values)) / std::sqrt(static_cast<double>(values.size()));
}

/// Six digits are far finer than what rounding to half leaves, and are read by people.
double six_digits(double value) { return std::stod(fmt::format("{:.6g}", value)); }

std::string shown(const json& object, const std::string& key) {
  return object.contains(key) ? brief(object[key]) : "nothing";
}

void check_recipe(const fs::path& file, const GenerateOptions& options, const std::string& assets,
                  const SayProblem& problem) {
  const json found = read_json_object(file), wanted = json::parse(recipe_text(options, assets));
  std::set<std::string> keys;
  for (const json* object : {&found, &wanted})
    for (const auto& [key, value] : object->items()) keys.insert(key);
  for (const std::string& key : keys)
    if (const std::string has = shown(found, key), needs = shown(wanted, key); has != needs)
      problem(file, fmt::format("{} is {}; expected {}", key, has, needs));
}

/// What `found` lacks of the names of the set, and what it has beyond them.
void compare(const std::vector<std::string>& found, const std::vector<std::string>& wanted,
             const std::function<void(const std::string& name, bool missing)>& differs) {
  const std::set<std::string> has(found.begin(), found.end()), needs(wanted.begin(), wanted.end());
  for (const std::string& name : wanted)
    if (!has.contains(name)) differs(name, true);
  for (const std::string& name : found)
    if (!needs.contains(name)) differs(name, false);
}

/// Runs a check; what cannot be read is a problem of its file.
bool checked(const SayProblem& problem, const std::function<void()>& check) {
  try {
    check();
    return true;
  } catch (const Error& e) {
    if (e.kind() != ErrorKind::Usage) throw;
    problem(e.where(), e.reason());
    return false;
  }
}

void check_views(const Manifest& manifest, const fs::path& room, const SayProblem& problem) {
  std::vector<std::string> ids;
  for (int view = 0; view < manifest.views.count; ++view) ids.push_back(view_id(view));
  compare(list_views(room), ids, [&](const std::string& id, bool missing) {
    problem(view_file(room, id, "im"), missing ? "the view is missing" : "the view is none of the set");
  });
  for (const std::string& id : ids) {
    if (!fs::exists(view_file(room, id, "im"))) continue;  // said above
    checked(problem, [&] { read_view(room, id); });        // with camera and emission where they are there
    for (const fs::path& file : {view_file(room, id, "camera", "json"), view_file(room, id, "emission")})
      if (!fs::exists(file)) problem(file, "is missing");
    checked(problem, [&] { read_map(view_file(room, id, "variance"), 3); });
    if (!manifest.light.wanted) continue;
    checked(problem, [&] { read_envmaps(room, id, manifest.views.width, manifest.views.height); });
    checked(problem, [&] { read_probes(room, id); });
  }
}

void check_means(const ViewMeans& wanted, const fs::path& room, const std::string& id, bool light,
                 const SayProblem& problem) {
  constexpr std::array<const char*, kViewMeans> files{"albedo", "material", "material", "normal", "normal",
                                                      "normal", "depth",    "im",       "envmap"};
  const ViewMeans found = measure_view(room, id, light);
  for (std::size_t k = 0; k < files.size(); ++k)
    if (!(std::abs(found[k].value - wanted[k].value) <= wanted[k].within))
      problem(view_file(room, id, files[k]),
              fmt::format("the mean of {} is {:.6g}; expected {:.6g} to within {:.3g}",
                          key_of(static_cast<ViewMean>(k)), found[k].value, wanted[k].value, wanted[k].within));
}

}  // namespace

fs::path rooms_of_split(const fs::path& dir, const SetSplit& split) { return dir / (split.name + ".rooms"); }

GenerateOptions options_of(const Manifest& manifest, const SetSplit& split, const fs::path& dir) {
  GenerateOptions options;
  options.out = dir / split.name;
  options.rooms.count = split.rooms, options.rooms.setting = split.setting, options.rooms.split = split.name;
  options.rooms.from = rooms_of_split(dir, split);
  options.views = manifest.views, options.light = manifest.light;
  options.views.handling = {};  // the cameras stand in the file
  return options;
}

RoomFile make_rooms(const Manifest& manifest, const SetSplit& split, const RoomAssets& assets,
                    const std::function<void(int)>& after) {
  RoomFile file{split.setting, {}};
  const auto count = static_cast<std::size_t>(manifest.views.count);
  for_each_room(split, assets, after, [&](int index, const std::string& name, std::uint64_t seed, const Room& room) {
    const std::span chosen = std::span(split.cameras).subspan(static_cast<std::size_t>(index) * count, count);
    file.rooms.push_back(describe_room(name, seed, room,
                                       chosen_views(room, chosen, manifest.views.width, manifest.views.height,
                                                    Random(seed).fork(kViewsStream), manifest.views.handling)));
  });
  return file;
}

std::vector<int> choose_cameras(const Device& device, const Manifest& manifest, const SetSplit& split,
                                const RoomAssets& assets, const std::function<void(int)>& after) {
  std::vector<int> cameras;
  for_each_room(split, assets, after, [&](int, const std::string&, std::uint64_t seed, const Room& room) {
    TraceScene scene(device, room.scene);
    choose_views(scene, room, manifest.views.count, manifest.views.width, manifest.views.height,
                 Random(seed).fork(kViewsStream), manifest.views.handling, &cameras);
  });
  return cameras;
}

ViewMeans measure_view(const fs::path& room, const std::string& id, bool light) {
  const RoomView view = read_view(room, id);
  const auto plane = [](const Image& image, int c) { return std::span(image.plane(c), image.pixels()); };
  ViewMeans means;
  const auto put = [&](ViewMean what, const MeanWithin& m) {
    means[static_cast<std::size_t>(what)] = {six_digits(m.value), six_digits(m.within)};
  };
  put(ViewMean::Albedo, mean_of(luminances(view.albedo, 1)));
  put(ViewMean::Roughness, mean_of(plane(view.material, 0))), put(ViewMean::Metallic, mean_of(plane(view.material, 1)));
  put(ViewMean::NormalX, mean_of(plane(view.normal, 0))), put(ViewMean::NormalY, mean_of(plane(view.normal, 1)));
  put(ViewMean::NormalZ, mean_of(plane(view.normal, 2))), put(ViewMean::Depth, mean_of(plane(view.depth, 0)));
  const double factor = 1 / view.exposure;
  put(ViewMean::Radiance, noisy_mean(luminances(view.image, factor),
                                     error_of_picture(read_map(view_file(room, id, "variance"), 3), factor)));
  if (!light) return means;
  const Envmaps envmaps = read_envmaps(room, id, view.image.width, view.image.height);
  read_probes(room, id);
  const std::vector<float> light_values = luminances(envmaps.radiance, factor);
  put(ViewMean::Light, noisy_mean(light_values, error_by_spread(light_values)));
  return means;
}

void check_split(const Manifest& manifest, const SetSplit& split, const fs::path& dir, int rooms,
                 const SayProblem& say) {
  std::set<std::pair<fs::path, std::string>> said;  // two checks may read one file
  const SayProblem problem = [&](const fs::path& file, const std::string& what) {
    if (said.emplace(file, what).second) say(file, what);
  };
  const GenerateOptions options = options_of(manifest, split, dir);
  checked(problem, [&] {
    const std::string found = hash_of(read_room_file(options.rooms.from));
    if (found != split.rooms_hash)
      problem(options.rooms.from, fmt::format("other rooms, of hash {}; expected {}", found, split.rooms_hash));
    check_recipe(options.out / "generate.json", options, manifest.assets_hash, problem);
  });
  std::vector<std::string> names, listed;
  for (int i = 0; i < std::min(rooms, split.rooms); ++i) names.push_back(room_name(naming_of(split), i));
  const fs::path list = options.out / (split.name + ".txt");
  const auto none = [](const Error&) {};  // what cannot be read of the list is missing
  if (!checked(problem, [&] { listed = list_rooms(options.out, split.name, none); })) return;
  compare(listed, names, [&](const std::string& name, bool missing) {
    problem(list, fmt::format("room {} is {}", name, missing ? "missing" : "none of the set"));
  });
  for (const std::string& name : names)
    if (fs::is_directory(options.out / name))
      checked(problem, [&] { check_views(manifest, options.out / name, problem); });
  for (std::size_t v = 0; v < split.views.size(); ++v) {
    const std::size_t count = static_cast<std::size_t>(manifest.views.count), room = v / count;
    if (room >= names.size()) break;
    const std::string id = view_id(static_cast<int>(v % count));
    if (fs::exists(view_file(options.out / names[room], id, "im")))
      checked(problem,
              [&] { check_means(split.views[v], options.out / names[room], id, manifest.light.wanted, problem); });
  }
}

}  // namespace clerestory
