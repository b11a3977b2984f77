#include "tracer/generate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/io/data_files.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/nesting.hpp"
#include "host/math/statistics.hpp"
#include "host/stopwatch.hpp"
#include "tracer/balls.hpp"
#include "tracer/envmaps.hpp"
#include "tracer/mitsuba_export.hpp"
#include "tracer/probes.hpp"
#include "tracer/stereo.hpp"
#include "tracer/trace_scene.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kMostBaseline = 1;  // metres; rooms are a few wide

void check(const GenerateOptions& o) {
  const auto range = [](const char* name, int value, int low, int high) {
    if (value < low || value > high) {
      throw usage_error("out of range", name, std::to_string(value), fmt::format("{} to {}", low, high));
    }
  };
  const auto count = [&](const char* name, int value, int high) {
    if (o.rooms.from.empty() || value != kAllRooms) range(name, value, 1, high);
  };
  count("--rooms", o.rooms.count, 1000000);
  count("--views", o.views.count, 1000);
  range("--size (width)", o.views.width, 16, 4096);
  range("--size (height)", o.views.height, 16, 4096);
  range("--spp", o.views.spp, 1, 1 << 20);
  range("--light-spp", o.light.spp, 1, 1 << 12);
  range("--probes", o.light.probes, 0, 100);
  if (!(o.views.clamp >= 0 && o.views.clamp <= 1e6)) {
    throw usage_error("out of range", "--clamp", fmt::format("{}", o.views.clamp), "0 to 1e6; 0 sets no bound");
  }
  if (o.baseline && !(*o.baseline > 0 && *o.baseline <= kMostBaseline))
    throw usage_error("out of range", "--baseline", fmt::format("{}", *o.baseline),
                      fmt::format("metres, above 0 to {}", kMostBaseline));
  const auto real_range = [](const char* name, double value, double high) {
    if (!(value >= 0 && value <= high))
      throw usage_error("out of range", name, fmt::format("{}", value), fmt::format("0 to {}", high));
  };
  const Handling& held = o.views.handling;
  real_range("--roll", held.roll, 45), real_range("--close-ups", held.close_ups, 1);
  real_range("--from-above", held.from_above, 1 - held.close_ups);  // views are one or the other
  for (const auto& [name, value] : {std::pair{"--roll", held.roll}, std::pair{"--close-ups", held.close_ups},
                                    std::pair{"--from-above", held.from_above}})
    if (!o.rooms.from.empty() && value > 0)
      throw usage_error(fmt::format("the rooms of {} have their cameras", o.rooms.from.string()), name,
                        fmt::format("{}", value), "left out beside --from-rooms");
  range("--shard (of)", o.rooms.shards, 1, 1000000);
  range("--shard", o.rooms.shard, 0, o.rooms.shards - 1);
  for (const char* s : {"auto", "train", "val", "test"}) {
    if (o.rooms.split == s) return;
  }
  throw usage_error("unknown split", "--split", o.rooms.split, "auto, train, val or test");
}

constexpr int kPilotSpp = 4, kPilotColumns = 160;  // a pilot asks for one number: a larger view has a smaller one

constexpr const char* kAssets = "assets";

fs::path assets_folder(const GenerateOptions& o) { return o.rooms.assets.empty() ? default_assets() : o.rooms.assets; }

/// What a folder's views depend on; a run with other values must not mix its views in. Without light its keys are left
/// out, as in folders made before there was any.
json recipe(const GenerateOptions& o, const std::string& assets_hash = {}) {
  json all{{"format", 1},
           {"views", o.views.count},
           {"width", o.views.width},
           {"height", o.views.height},
           {"spp", o.views.spp},
           {"clamp", o.views.clamp},
           {"seed", o.rooms.seed},
           {"balls", o.balls},
           {"split", o.rooms.split},
           {"setting", o.rooms.setting == Setting::HeldOut ? "held_out" : "training"},
           {"box_rooms", o.rooms.boxes},
           {"exposure", "quantile"}};  // sets of before it was interpolated have none: they are not gone on with
  if (o.baseline) all["stereo_baseline"] = *o.baseline;
  if (!o.rooms.seeds.empty()) all["room_seeds"] = o.rooms.seeds;
  if (!o.rooms.from.empty()) all["from_rooms"] = file_hash(o.rooms.from);
  if (!o.rooms.boxes) all[kAssets] = assets_hash.empty() ? hash_of_assets(assets_folder(o)) : assets_hash;
  // Left out where cameras are level and across the room, as in folders made before there were others.
  if (o.views.handling.roll > 0) all["roll"] = o.views.handling.roll;
  if (o.views.handling.close_ups > 0) all["close_ups"] = o.views.handling.close_ups;
  if (o.views.handling.from_above > 0) all["from_above"] = o.views.handling.from_above;
  if (o.views.clamp > 0 && o.views.width > kPilotColumns) all["pilot"] = kPilotColumns;
  if (o.light.wanted) all["light_spp"] = o.light.spp, all["probes"] = o.light.probes;
  return all;
}

/// What stands in the folder under a name that would be written.
std::string in_the_way(const GenerateOptions& o, const std::vector<std::string>& rooms) {
  std::vector<std::string> names{"train.txt", "val.txt", "test.txt"};
  names.insert(names.end(), rooms.begin(), rooms.end());
  const auto found = std::ranges::find_if(names, [&](const std::string& name) { return fs::exists(o.out / name); });
  return found == names.end() ? "" : *found;
}

/// What of `one` is not so in the other recipe.
std::string other_than(const json& one, const json& other) {
  std::string text;
  for (const auto& [key, value] : one.items())
    if (!other.contains(key) || other[key] != value)
      text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", key, value.dump());
  return text.empty() ? "nothing of it" : text;
}

/// `rooms`: their names.
void claim_folder(const GenerateOptions& o, const std::vector<std::string>& rooms) {
  make_directories(o.out);
  const fs::path file = o.out / "generate.json";
  // In this order: another shard may claim the folder meanwhile, and it writes generate.json first.
  if (const std::string name = in_the_way(o, rooms); !name.empty() && !fs::exists(file))
    throw usage_error("the folder holds another data set", o.out.string(), name,
                      "a new folder, or one with generate.json");
  json wanted = recipe(o);
  if (fs::exists(file)) {
    const std::string text = read_file(file, 1 << 20);
    check_nesting(text, file.string());
    const json found = json::parse(text, nullptr, false);
    if (!found.is_object()) throw usage_error("is no record of generated views", file.string(), "no JSON object");
    if (!found.contains(kAssets)) wanted.erase(kAssets);  // folders of before they were named
    if (found != wanted)
      throw usage_error("the folder holds views made with other options", file.string(), other_than(found, wanted),
                        other_than(wanted, found) + "; or another --out");
    return;
  }
  write_file(file, recipe_text(o));
}

/// A room with its cameras, ready to be traced.
struct StandingRoom {
  StandingRoom(const Device& device, std::string its_name, std::uint64_t its_seed, Room its)
      : name(std::move(its_name)), seed(its_seed), room(std::move(its)), scene(device, room.scene) {}
  std::string name;
  std::uint64_t seed;
  Room room;
  TraceScene scene;
  std::vector<Camera> cameras;
};

/// Where rooms come from: the rules, or a file.
class RoomSource {
 public:
  explicit RoomSource(GenerateOptions& o) : options_(o) {
    if (!o.rooms.from.empty()) read(o);
    if (!o.rooms.boxes) assets_ = load_assets(assets_folder(o), o.rooms.setting);
  }

  /// Rooms that a run with a larger count would have.
  int most() const {
    const std::size_t seeds = options_.rooms.seeds.size(), most = from_file() ? file_.rooms.size() : seeds;
    return most > 0 ? static_cast<int>(most) : std::numeric_limits<int>::max();
  }
  std::string name(int index) const { return from_file() ? description(index).name : room_name(options_, index); }

  std::unique_ptr<StandingRoom> room(const Device& device, int index) const {
    const GenerateOptions& o = options_;
    const std::uint64_t seed = from_file() ? description(index).seed : room_seed(o, index);
    auto standing = std::make_unique<StandingRoom>(device, name(index), seed,
                                                   from_file()     ? description(index).build(assets_)
                                                   : o.rooms.boxes ? make_box_room(seed)
                                                                   : make_room(seed, o.rooms.setting, assets_));
    if (!from_file())
      standing->cameras = choose_views(standing->scene, standing->room, o.views.count, o.views.width, o.views.height,
                                       Random(seed).fork(kViewsStream), o.views.handling);
    else
      standing->cameras = description(index).views(o.views.count, o.views.width, o.views.height);
    return standing;
  }

 private:
  bool from_file() const { return !options_.rooms.from.empty(); }
  const RoomDescription& description(int index) const { return file_.rooms[static_cast<std::size_t>(index)]; }

  void read(GenerateOptions& o) {
    file_ = read_room_file(o.rooms.from);
    o.rooms.setting = file_.setting, o.rooms.seed = 0, o.rooms.boxes = false;
    const std::string where = o.rooms.from.string();
    if (!o.rooms.seeds.empty()) file_ = rooms_of_seeds(file_, o.rooms.seeds, where);
    if (file_.rooms.empty()) throw usage_error("there are no rooms in the file", where);
    if (o.rooms.count == kAllRooms) o.rooms.count = static_cast<int>(file_.rooms.size());
    if (o.views.count == kAllRooms) o.views.count = static_cast<int>(file_.rooms[0].cameras.size());
    if (static_cast<std::size_t>(o.rooms.count) > file_.rooms.size())
      throw usage_error("the file has fewer rooms", where, fmt::format("{}", file_.rooms.size()),
                        fmt::format("{} (--rooms)", o.rooms.count));
    for (const RoomDescription& room : file_.rooms)
      room.views(o.views.count, o.views.width, o.views.height);  // or says what is wrong
  }

  const GenerateOptions& options_;
  RoomFile file_;
  RoomAssets assets_;
};

/// Throws where a list is none that a run of this recipe for fewer or more rooms would have written.
void expect_own_list(const GenerateOptions& o, const RoomSource& source, const std::string& split) {
  const fs::path file = o.out / (split + ".txt");
  if (!fs::exists(file)) return;
  std::istringstream lines(read_file(file, 1 << 26));
  std::string line;
  int index = 0;
  for (int number = 1; std::getline(lines, line); ++number) {
    // Of ten rooms in turn at least one is of any split that has rooms.
    const int last = std::min(source.most(), index + 10);
    while (index < last && split_of(o, index) != split) ++index;
    if (index >= last || split_of(o, index) != split || source.name(index++) != line)
      throw usage_error("the list was changed, and would be written anew", fmt::format("{}:{}", file.string(), number),
                        line, "the list as `generate` wrote it, or another folder");
  }
}

void write_lists(const GenerateOptions& o, const RoomSource& source) {
  for (const char* split : {"train", "val", "test"}) expect_own_list(o, source, split);
  // Every shard knows all names and writes the same lists; a split without rooms has none.
  for (const char* split : {"train", "val", "test"}) {
    std::vector<std::string> names;
    for (int i = 0; i < o.rooms.count; ++i) {
      if (split_of(o, i) == split) names.push_back(source.name(i));
    }
    if (names.empty())
      remove_tree(o.out / fmt::format("{}.txt", split));  // of a run for more rooms
    else
      write_rooms(o.out, split, names);
  }
}

/// Half where it fits: pictures and balls need no more.
void write_radiance(const fs::path& path, const Image& image) {
  write_exr(path, image, fits_half(image) ? ExrType::Half : ExrType::Float);
}

constexpr std::uint64_t kPictureStream = 0x5eedu;   // of a room's random numbers
constexpr std::uint32_t kLightStream = 0x119475u;   // parts light's random numbers from the picture's
constexpr std::uint32_t kStereoStream = 0x57e4e0u;  // and those of the second camera
// A view has some nineteen texels of environment maps for one of a probe, which is looked at on its own.
constexpr int kProbeSpp = 4;

class RoomWriter {
 public:
  RoomWriter(const Device& device, const GenerateOptions& options, std::unique_ptr<StandingRoom> room)
      : device_(device), options_(options), standing_(std::move(room)), scene_(standing_->scene) {
    make_directories(options.out / standing_->name);
  }

  void write(int view, GenerateSummary& summary) {
    const fs::path folder = options_.out / standing_->name;
    const std::string id = view_id(view);
    const Camera& camera = standing_->cameras[static_cast<std::size_t>(view)];
    const std::uint32_t seed = Random(standing_->seed).fork(kPictureStream).seed(static_cast<std::uint64_t>(view));
    const float most = most_indirect(camera, seed);
    TracePicture picture = scene_.picture(camera, options_.views.spp, seed, kMaxDepth, kLightSamples, most);
    note(picture.dropped, id, seed, summary);
    TraceMaps maps = scene_.maps(camera);

    RoomView out;
    out.exposure = exposure_of(picture.mean.data);
    if (options_.light.wanted) {
      const Stopwatch watch;
      write_light(folder, id, camera, maps, most, out.exposure, Random(seed ^ kLightStream), summary);
      summary.light_seconds += watch.seconds();
    }
    fill_maps(out, camera, std::move(maps));
    out.image = std::move(picture.mean);
    scale(out.image.data, out.exposure);
    scale(out.emission->data, out.exposure);
    scale(picture.variance.data, out.exposure * out.exposure);
    if (options_.views.variance) write_exr(view_file(folder, id, "variance"), picture.variance, ExrType::Float);
    if (options_.baseline) write_right(folder, id, camera, seed, most, out.exposure, summary);
    if (options_.balls) write_balls(folder, id, camera, seed, most, out.exposure, summary);
    write_camera(view_file(folder, id, "camera", "json"), camera, out.exposure);
    write_view(folder, id, out);  // its picture comes last: a view that has it is complete
  }

  void write_scene(const fs::path& folder) const {
    write_mitsuba_scene(folder, standing_->room.scene, standing_->cameras);
  }

 private:
  /// The bound on indirect light is stated against white, so a few samples find the exposure first.
  float most_indirect(const Camera& camera, std::uint32_t seed) {
    if (options_.views.clamp <= 0) return std::numeric_limits<float>::infinity();
    const int columns = std::min(camera.width, kPilotColumns);
    const Camera pilot = camera.resized(columns, std::max(1, camera.height * columns / camera.width));
    const double exposure = exposure_of(scene_.picture(pilot, kPilotSpp, seed + 1).mean.data);
    return static_cast<float>(options_.views.clamp / exposure);
  }

  static void fill_maps(RoomView& out, const Camera& camera, TraceMaps maps) {
    out.mask = Image(camera.width, camera.height, 1);
    out.material = Image(camera.width, camera.height, 3);
    for (std::size_t i = 0; i < maps.depth.pixels(); ++i) {
      out.mask.data[i] = maps.depth.data[i] > 0 ? 1.f : 0.f;
      out.material.plane(0)[i] = maps.roughness.data[i];
      out.material.plane(1)[i] = maps.metallic.data[i];
    }
    out.depth = std::move(maps.depth), out.normal = std::move(maps.normal), out.albedo = std::move(maps.albedo);
    out.emission = std::move(maps.emission);
    out.camera = camera;
  }

  void write_light(const fs::path& folder, const std::string& id, const Camera& camera, const TraceMaps& maps,
                   float most, double exposure, Random random, GenerateSummary& summary) {
    RadianceQuery query;
    query.spp = options_.light.spp, query.most_indirect = most, query.seed = static_cast<std::uint32_t>(random.bits());
    DroppedSamples dropped;
    Envmaps envmaps = trace_envmaps(scene_, standing_->room.scene, camera, maps, query, &dropped);
    note(dropped, id + " envmap", query.seed, summary);
    scale(envmaps.radiance.data, exposure);
    write_envmaps(folder, id, envmaps);

    query.spp = kProbeSpp * options_.light.spp;
    std::vector<Probe> probes =
        place_probes(scene_, standing_->room.scene, camera, maps, options_.light.probes, random.fork(0));
    for (Probe& probe : probes) {
      query.seed = static_cast<std::uint32_t>(random.bits());
      trace_probe(scene_, camera, probe, query, &dropped);
      note(dropped, id + " probe", query.seed, summary);
      scale(probe.radiance.data, exposure);
    }
    write_probes(folder, id, probes);
  }

  /// The second camera's picture under the first one's exposure, by other random numbers.
  void write_right(const fs::path& folder, const std::string& id, const Camera& left, std::uint32_t seed, float most,
                   double exposure, GenerateSummary& summary) {
    const std::optional<Camera> right = right_camera(scene_, left, *options_.baseline);
    if (!right) return;
    const auto its = static_cast<std::uint32_t>(Random::mix(seed ^ kStereoStream));
    TracePicture picture = scene_.picture(*right, options_.views.spp, its, kMaxDepth, kLightSamples, most);
    note(picture.dropped, id + " right", its, summary);
    scale(picture.mean.data, exposure);
    write_radiance(view_file(folder, id, "right"), picture.mean);
    write_stereo(folder, id, left, *right, exposure);
  }

  /// The view's picture again with a ball in it: the same random numbers, the same bound of indirect light.
  void write_balls(const fs::path& folder, const std::string& id, const Camera& camera, std::uint32_t seed, float most,
                   double exposure, GenerateSummary& summary) {
    const std::optional<BallPlace> place =
        place_ball(scene_, standing_->room.scene, camera, Random(standing_->seed).fork(200 + seed));
    json balls = json::array();
    if (place) {
      for (const BallKind& kind : ball_kinds()) {
        TraceScene with(device_, with_ball(standing_->room.scene, camera, *place, kind));
        TracePicture picture = with.picture(camera, options_.views.spp, seed, kMaxDepth, kLightSamples, most);
        note(picture.dropped, id + " ball_" + kind.name, seed, summary);
        scale(picture.mean.data, exposure);
        write_radiance(view_file(folder, id, "ball_" + kind.name), picture.mean);
        balls.push_back({{"name", kind.name},
                         {"center", {place->center.x, place->center.y, place->center.z}},
                         {"radius", place->radius},
                         {"albedo", {kind.albedo, kind.albedo, kind.albedo}},
                         {"roughness", kind.roughness},
                         {"metallic", kind.metallic}});
      }
    }
    // A view without a place for a ball has an empty list and no ball pictures.
    write_file(view_file(folder, id, "balls", "json"), balls.dump(2) + "\n");
  }

  void note(const DroppedSamples& dropped, const std::string& id, std::uint32_t seed, GenerateSummary& summary) const {
    if (dropped.count > 0 && summary.dropped == 0) {
      summary.first_dropped =
          fmt::format("{}/{} pixel {} sample {} seed {}", standing_->name, id, dropped.pixel, dropped.sample, seed);
    }
    summary.dropped += dropped.count;
  }

  Device device_;
  const GenerateOptions& options_;
  std::unique_ptr<StandingRoom> standing_;
  TraceScene& scene_;
};

}  // namespace

std::filesystem::path default_assets() {
  const char* named = std::getenv("CLERESTORY_ASSETS");
  const std::vector<fs::path> places = named != nullptr ? std::vector<fs::path>{named} : data_places("assets");
  for (const fs::path& place : places)
    if (fs::is_directory(place / "hdri")) return place;
  throw usage_error("no folder of panoramas and models was found; name it by --assets or CLERESTORY_ASSETS",
                    text_of(places));
}

std::string recipe_text(const GenerateOptions& options, const std::string& assets_hash) {
  return recipe(options, assets_hash).dump(2) + "\n";
}

std::string room_name(const GenerateOptions& options, int index) {
  return fmt::format("{}room-s{}-{:05}", options.rooms.setting == Setting::HeldOut ? "held-out-" : "",
                     options.rooms.seed, index);
}

std::uint64_t room_seed(const GenerateOptions& options, int index) {
  if (!options.rooms.seeds.empty()) return options.rooms.seeds.at(static_cast<std::size_t>(index));
  return Random::mix(Random::mix(options.rooms.seed + 1) ^ static_cast<std::uint64_t>(index)) ^
         (options.rooms.setting == Setting::HeldOut ? 1 : 0);
}

std::string split_of(const GenerateOptions& options, int index) {
  if (options.rooms.split != "auto") return options.rooms.split;
  return index % 10 == 8 ? "val" : index % 10 == 9 ? "test" : "train";
}

void GenerateSummary::add(const GenerateSummary& other) {
  made += other.made, skipped += other.skipped, scenes += other.scenes;
  seconds += other.seconds, light_seconds += other.light_seconds;
  if (dropped == 0) first_dropped = other.first_dropped;
  dropped += other.dropped;
}

RoomFile describe_rooms(const Device& device, const GenerateOptions& asked) {
  GenerateOptions options = asked;
  check(options);
  const RoomSource source(options);
  RoomFile file{options.rooms.setting, {}};
  for (int index = 0; index < options.rooms.count; ++index) {
    const auto made = source.room(device, index);
    file.rooms.push_back(describe_room(made->name, made->seed, made->room, made->cameras));
    if (options.progress) options.progress(index + 1, options.rooms.count, true);
    if (options.interrupted && options.interrupted()) throw Error(ErrorKind::Interrupted, "nothing is written");
  }
  return file;
}

struct RoomMaker::State {
  Device device;
  GenerateOptions options;
  RoomSource source;

  State(const Device& its_device, const GenerateOptions& its) : device(its_device), options(its), source(checked()) {}
  GenerateOptions& checked() {
    if (options.out.empty()) throw usage_error("a folder is needed", "--out");
    check(options);
    return options;
  }

  void make(int index, GenerateSummary& summary) {
    const fs::path folder = options.out / source.name(index);
    std::unique_ptr<RoomWriter> room;  // built when the first view is missing, or the scene
    const auto standing = [&]() -> RoomWriter& {
      if (!room) room = std::make_unique<RoomWriter>(device, options, source.room(device, index));
      return *room;
    };
    if (const fs::path scene = folder / "mitsuba"; options.mitsuba && !fs::exists(scene))
      standing().write_scene(scene), ++summary.scenes;
    for (int view = 0; view < options.views.count; ++view) {
      if (options.interrupted && options.interrupted())
        throw Error(ErrorKind::Interrupted,
                    fmt::format("stopped after {} views; run the same line again to go on", summary.views()));
      const bool missing = !fs::exists(view_file(folder, view_id(view), "im"));
      if (!missing) {
        ++summary.skipped;
      } else {
        const Stopwatch watch;
        standing().write(view, summary);
        summary.seconds += watch.seconds();
        ++summary.made;
      }
      if (options.progress) options.progress(summary.views(), own_rooms() * options.views.count, missing);
    }
  }

  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (int i = 0; i < options.rooms.count; ++i) all.push_back(source.name(i));
    return all;
  }

  int own_rooms() const {
    return (options.rooms.count - options.rooms.shard + options.rooms.shards - 1) / options.rooms.shards;
  }
};

RoomMaker::RoomMaker(const Device& device, const GenerateOptions& options)
    : state_(std::make_unique<State>(device, options)) {}
RoomMaker::~RoomMaker() = default;
std::string RoomMaker::name(int index) const { return state_->source.name(index); }
void RoomMaker::make(int index, GenerateSummary& summary) { state_->make(index, summary); }

GenerateSummary generate(const Device& device, const GenerateOptions& asked) {
  RoomMaker::State maker(device, asked);
  const GenerateOptions& options = maker.options;
  claim_folder(options, maker.names());
  write_lists(options, maker.source);
  GenerateSummary summary;
  for (int index = options.rooms.shard; index < options.rooms.count; index += options.rooms.shards)
    maker.make(index, summary);
  return summary;
}

}  // namespace clerestory
