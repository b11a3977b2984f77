#include "experiments/commands/generate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "experiments/commands/cli.hpp"
#include "experiments/commands/named_set.hpp"
#include "experiments/evaluation/layouts.hpp"
#include "experiments/truth/room_list.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "tracer/generate.hpp"
#include "tracer/stereo.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct Options {
  GenerateOptions generate;
  PixelSize size{160, 120};
  std::optional<int> rooms, views;  // of a file all, else GenerateOptions's
  std::optional<double> baseline;   // of --stereo
  fs::path write_rooms, list, sheet, manifest;
  std::string shard = "0/1", setting = "training", layout;
  bool no_light = false, write_expected = false, stereo = false;
};

/// "I/N", 0 <= I < N.
void read_shard(const std::string& text, RoomChoice& to) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) throw usage_error("not a shard", "--shard", text, "I/N, such as 0/4");
  read_value(text.substr(0, slash), "--shard", to.shard);
  read_value(text.substr(slash + 1), "--shard", to.shards);
  if (to.shards < 1 || to.shard < 0 || to.shard >= to.shards) {
    throw usage_error("out of range", "--shard", text, "0 <= I < N");
  }
}

/// The rooms of a list, as the rules make them.
void read_list(Options& options) {
  GenerateOptions& o = options.generate;
  if (!o.rooms.from.empty() || o.rooms.boxes)
    throw usage_error("rooms of a list are made by the rules", "--list", options.list.string(),
                      "neither --from-rooms nor --box-rooms");
  const RoomList list = read_room_list(options.list);
  o.rooms.setting = list.setting, o.rooms.seeds = list.seeds;
  const int all = static_cast<int>(list.seeds.size());
  if (options.rooms.value_or(all) > all)
    throw usage_error("the list has fewer rooms", options.list.string(), fmt::format("{}", all),
                      fmt::format("{} (--rooms)", *options.rooms));
  options.rooms = options.rooms.value_or(all);
}

Image of_sheet(const GenerateOptions& o, const fs::path& file) {
  const Image picture = read_image(file);
  if (picture.width != o.views.width || picture.height != o.views.height)
    throw usage_error("another size than the other views", file.string(),
                      fmt::format("{}x{}", picture.width, picture.height),
                      fmt::format("{}x{}", o.views.width, o.views.height));
  return show_radiance(picture);
}

/// One PNG of all pictures that the folder has of these rooms: rooms below each other, as square as it gets.
void write_sheet(const GenerateOptions& o, const fs::path& file) {
  std::vector<Image> pictures;
  for (const char* split : {"train", "val", "test"}) {
    if (!fs::exists(o.out / fmt::format("{}.txt", split))) continue;
    for (const std::string& room : list_rooms(o.out, split))
      for (const std::string& view : list_views(o.out / room))
        pictures.push_back(of_sheet(o, view_file(o.out / room, view, "im")));
  }
  if (pictures.empty()) throw usage_error("no view is there to be shown", "--sheet", o.out.string());
  const int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(pictures.size()))));
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  Image sheet(columns * o.views.width, rows * o.views.height, 3);
  for (std::size_t k = 0; k < pictures.size(); ++k)
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < o.views.height; ++y) {
        const float* row = pictures[k].plane(c) + static_cast<std::ptrdiff_t>(y) * o.views.width;
        const std::ptrdiff_t line = (static_cast<int>(k) / columns) * o.views.height + y;
        std::copy(row, row + o.views.width,
                  sheet.plane(c) + line * sheet.width + (static_cast<int>(k) % columns) * o.views.width);
      }
  write_png(file, sheet, Encoding::Linear);
}

std::string summary_json(const fs::path& out, const GenerateSummary& s) {
  return json_text(nlohmann::ordered_json{{"out", out.string()},
                                          {"made", s.made},
                                          {"skipped", s.skipped},
                                          {"scenes", s.scenes},
                                          {"seconds", s.seconds},
                                          {"light_seconds", s.light_seconds},
                                          {"views_per_hour", s.seconds > 0 ? 3600 * s.made / s.seconds : 0},
                                          {"dropped_samples", s.dropped},
                                          {"first_dropped", s.first_dropped}});
}

/// What a run has made, as JSON and for people.
void tell(const fs::path& out, const GenerateSummary& summary, const CommonOptions& common) {
  if (common.json) write_json_result(common, summary_json(out, summary));
  say(fmt::format(
      "{}: {} views made, {} were there; {}{}", out.string(), summary.made, summary.skipped,
      duration_text(summary.seconds),
      summary.made > 0 ? fmt::format(", {:.0f} views an hour", 3600 * summary.made / summary.seconds) : ""));
  if (summary.scenes > 0) say(fmt::format("scenes of Mitsuba: {} written", summary.scenes));
  if (summary.light_seconds > 0)
    say(fmt::format("environment maps and probes took {:.0f} % of the time",
                    100 * summary.light_seconds / summary.seconds));
  say(summary.dropped == 0
          ? "samples that were not finite: none"
          : fmt::format("samples that were not finite: {} dropped, first {}", summary.dropped, summary.first_dropped));
}

/// The same rooms once more, as another data set lies on disk.
void add_layout(const fs::path& rooms, const std::string& layout) {
  std::unique_ptr<Progress> bar;
  write_layout(rooms, layout, [&](int done, int total) {
    if (!bar) bar = std::make_unique<Progress>(layout, total, "views");
    bar->update(done);
    stop_if_interrupted("generate");
  });
  bar.reset();
  say(fmt::format("{}: written", (rooms / layout).string()));
}

void refuse(const char* option, const char* beside, bool given) {
  if (given) throw usage_error(fmt::format("does not go with {}", beside), option);
}

/// A layout is of the rooms of a whole folder.
void check_layout(const Options& options) {
  if (options.layout.empty()) return;
  const char* layout = "--layout, which is of all rooms of a folder";
  refuse("--shard", layout, options.generate.rooms.shards > 1);
  refuse("--manifest", layout, !options.manifest.empty());
  refuse("--write-rooms", layout, !options.write_rooms.empty());
  check_layout_is_new(options.generate.out, options.layout);
}

/// What is of a whole folder does not go with a part of its rooms, and what a file fixes not with another word on it.
void check_together(const Options& options, const CommonOptions& common) {
  const GenerateOptions& o = options.generate;
  const bool part = o.rooms.shards > 1, list = !options.list.empty(), from = !o.rooms.from.empty();
  const bool described = !options.write_rooms.empty();
  refuse("--sheet", "--shard: it shows all rooms of a folder", part && !options.sheet.empty());
  refuse("--shard", "--write-rooms, which describes all rooms", part && described);
  for (const char* traced :
       {"--sheet", "--balls", "--stereo", "--spp", "--light-spp", "--probes", "--no-light", "--clamp"})
    refuse(traced, "--write-rooms, which traces nothing", described && was_given(common, traced));
  refuse("--setting", "--list, which says it", list && was_given(common, "--setting"));
  refuse("--seed", "--list, which has the seeds", list && was_given(common, "--seed"));
  refuse("--setting", "--from-rooms, whose file says it", from && was_given(common, "--setting"));
  refuse("--seed", "--from-rooms, whose rooms are made", from && was_given(common, "--seed"));
  refuse("--box-rooms", "--from-rooms, whose rooms are made", from && o.rooms.boxes);
  refuse("--light-spp", "--no-light", options.no_light && was_given(common, "--light-spp"));
  refuse("--probes", "--no-light", options.no_light && was_given(common, "--probes"));
}

/// Makes what a manifest names.
void run_manifest(const Options& options, const CommonOptions& common) {
  refuse_fixed(common);
  SetWish wish;
  wish.manifest = options.manifest, wish.out = options.generate.out, wish.assets = options.generate.rooms.assets;
  wish.rooms = options.rooms, wish.write_expected = options.write_expected, wish.mitsuba = options.generate.mitsuba;
  wish.shard = options.generate.rooms.shard, wish.shards = options.generate.rooms.shards;
  tell(wish.out, make_set(common.device, wish), common);
}

/// Describes the rooms in place of tracing them.
void write_description(const Options& options, const CommonOptions& common) {
  const GenerateOptions& o = options.generate;
  if (!o.out.empty() || common.json || o.mitsuba)
    throw usage_error("nothing is traced where rooms are written", "--write-rooms",
                      !o.out.empty() ? "--out"
                      : o.mitsuba    ? "--mitsuba"
                                     : "--json");
  const AtomicFile tried(options.write_rooms);
  const RoomFile file = describe_rooms(Device::open(common.device), o);
  write_room_file(options.write_rooms, file);
  say(fmt::format("{}: {} rooms of {} views", options.write_rooms.string(), file.rooms.size(),
                  file.rooms[0].cameras.size()));
}

void run(Options& options, const CommonOptions& common) {
  GenerateOptions& o = options.generate;
  o.views.width = options.size.width, o.views.height = options.size.height;
  o.rooms.seed = common.seed;
  if (common.spp) {
    if (*common.spp > 1 << 20) throw usage_error("out of range", "--spp", std::to_string(*common.spp), "1 to 1048576");
    o.views.spp = static_cast<int>(*common.spp);
  }
  if (options.baseline && !options.stereo)
    throw usage_error("between which cameras?", "--baseline", fmt::format("{}", *options.baseline),
                      "--stereo beside it");
  if (options.stereo) o.baseline = options.baseline.value_or(kBaseline);
  read_shard(options.shard, o.rooms);
  check_layout(options);
  check_together(options, common);
  if (!options.manifest.empty()) return run_manifest(options, common);
  if (options.write_expected) throw usage_error("is for a manifest", "--write-expected", "", "--manifest FILE");
  o.light.wanted = !options.no_light;
  o.rooms.setting = options.setting == "held_out" ? Setting::HeldOut : Setting::Training;
  if (!options.list.empty()) read_list(options);
  o.rooms.count = options.rooms.value_or(o.rooms.from.empty() ? o.rooms.count : kAllRooms);
  o.views.count = options.views.value_or(o.rooms.from.empty() ? o.views.count : kAllRooms);
  catch_interrupts();
  o.interrupted = [] { return interrupted(); };
  std::unique_ptr<Progress> progress;
  o.progress = [&](int done, int total, bool made) {
    if (!made) return;  // skipped views say nothing about speed, nor does the first, which builds kernels
    if (!progress)
      progress = std::make_unique<Progress>("generate", total, options.write_rooms.empty() ? "views" : "rooms", done);
    progress->update(done);
  };
  if (!options.write_rooms.empty()) return write_description(options, common);
  if (!options.sheet.empty()) AtomicFile tried(options.sheet);
  const GenerateSummary summary = generate(Device::open(common.device), o);
  progress.reset();
  if (!options.sheet.empty()) write_sheet(o, options.sheet);
  if (!options.layout.empty()) add_layout(o.out, options.layout);
  tell(o.out, summary, common);
}

}  // namespace

void add_generate_command(CommandLine& line) {
  auto options = std::make_shared<Options>();
  GenerateOptions& o = options->generate;
  line.add("generate", "Make rooms: pictures, material, geometry, light")
      .option("--out", "DIR", "folder of the data set", o.out)
      .option("--rooms", "N", "number of rooms; 1 by default, of a file all", options->rooms)
      .option("--views", "N", "views of each room; 5 by default, of a file all", options->views)
      .option("--list", "FILE",
              "rooms of the seeds and the setting in a list (experiments/rooms), as they are made now", options->list)
      .option("--write-rooms", "FILE", "describe the rooms and their cameras in a file, and trace nothing",
              options->write_rooms)
      .option("--from-rooms", "FILE", "trace the rooms of such a file, whatever rooms are made like by now",
              o.rooms.from)
      .option("--manifest", "FILE",
              "make the data set that such a file names (experiments/rooms): it fixes all that pixels follow from",
              options->manifest)
      .flag("--write-expected",
            "choose a manifest's cameras, trace its first rooms, and write into it what must come out",
            options->write_expected)
      .option("--size", "WxH", "pixels of a view", options->size)
      .option("--clamp", "X",
              "most that one indirect contribution adds to a pixel or to a direction of the light, white = 0.9; fewer "
              "specks, a little too dark; 0: off",
              o.views.clamp)
      .option("--shard", "I/N", "make only rooms I, I + N, I + 2N, ...", options->shard)
      .flag("--no-light", "no environment maps and probes: enough to train what sees maps only", options->no_light)
      .option("--light-spp", "N", "samples of each direction of an environment map; a probe's get four times as many",
              o.light.spp)
      .option("--probes", "K", "panoramas of each view at points in free air", o.light.probes)
      .option("--sheet", "FILE", "also one PNG with the pictures of all views", options->sheet)
      .choice(
          "--layout",
          "also the rooms as IIW (judgements of true albedo), NYUv2 or OpenRooms lie on disk, in the folder of that "
          "name below --out",
          options->layout, {"iiw", "nyu", "openrooms"})
      .option("--roll", "DEGREES", "views are turned about their axis by at most so much, mostly by less; 0 by default",
              o.views.handling.roll)
      .option("--close-ups", "SHARE", "of the views that look at a piece of furniture from 0.6 to 1.6 m; 0 by default",
              o.views.handling.close_ups)
      .option("--from-above", "SHARE", "of the views that look down from where a person stands; 0 by default",
              o.views.handling.from_above)
      .flag("--balls", "also each view with a mirror, a glossy and a diffuse ball", o.balls)
      .flag("--stereo", "also each view from a second camera to the right, its camera file and its relative pose",
            options->stereo)
      .option("--baseline", "METRES", "between the cameras of --stereo, at most 1; 0.1 by default", options->baseline)
      .flag("--mitsuba",
            "also each room as a scene of Mitsuba 3, in its folder mitsuba/: scene.xml, PLY meshes, panorama",
            o.mitsuba)
      .choice("--setting", "what rooms may show; held_out: only what training rooms never do", options->setting,
              {"training", "held_out"})
      .choice("--split", "list the rooms as; auto: of ten, eight train, one val, one test", o.rooms.split,
              {"auto", "train", "val", "test"})
      .option("--assets", "DIR", "folder with hdri/ and models/", o.rooms.assets)
      .flag("--box-rooms", "bare boxes with a lamp and a few blocks and balls", o.rooms.boxes)
      .common({Common::Device, Common::Seed, Common::Spp, Common::Json, Common::Quiet})
      .notes(
          "Complete views are skipped: run the same line again to go on after an interruption. 64 samples a pixel by "
          "default. Environment maps: 40 tiles along the longer side, 16 azimuths x 8 elevations each.")
      .run([options](const CommonOptions& common) { run(*options, common); });
}

}  // namespace clerestory
