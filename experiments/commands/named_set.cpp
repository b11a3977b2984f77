#include "experiments/commands/named_set.hpp"

#include <algorithm>
#include <memory>

#include "host/io/data_files.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/report/progress.hpp"
#include "tracer/named_set.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// Makes a set split by split, one progress over all of them.
class SetMaker {
 public:
  SetMaker(const Device& device, const SetWish& wish)
      : device_(device),
        wish_(wish),
        manifest_(read_manifest(wish.manifest, !wish.write_expected)),
        assets_(wish.assets.empty() ? default_assets() : wish.assets) {
    make_directories(wish.out);
    const std::string hash = hash_of_assets(assets_);
    if (wish.write_expected)
      begin_expected(hash);
    else if (hash != manifest_.assets_hash)
      throw usage_error("panoramas and models are others than the set's", assets_.string(), hash,
                        fmt::format("{} ({}: expected.assets)", manifest_.assets_hash, manifest_.file.string()));
  }

  GenerateSummary make() {
    for (SetSplit& split : manifest_.splits) describe(split);
    announce();
    GenerateSummary all;
    for (const SetSplit& split : manifest_.splits) trace(split, all);
    progress_.reset();
    if (wish_.write_expected)
      write_expected();
    else
      check();
    return all;
  }

 private:
  int rooms_of(const SetSplit& split) const {
    return std::min(wish_.write_expected ? kMeasuredRooms : wish_.rooms.value_or(split.rooms), split.rooms);
  }
  int views_of(const SetSplit& split) const {
    return manifest_.views.count * ((rooms_of(split) - wish_.shard + wish_.shards - 1) / wish_.shards);
  }
  int all_views() const {
    int views = 0;
    for (const SetSplit& split : manifest_.splits) views += views_of(split);
    return views;
  }

  /// A version that is out keeps what it means.
  void begin_expected(const std::string& assets) {
    if (manifest_.expected_version == manifest_.version)
      throw usage_error("what must come out of this version is written already", manifest_.file.string(),
                        fmt::format("version {}", manifest_.version), "a higher version");
    const AtomicFile tried(manifest_.file);
    manifest_.expected_version = manifest_.version, manifest_.assets_hash = assets;
  }

  /// The rooms of a split as a file, unless they are there.
  void describe(SetSplit& split) {
    const fs::path file = rooms_of_split(wish_.out, split);
    if (!wish_.write_expected && fs::exists(file)) return expect_rooms(file, split);
    Progress bar("rooms of " + split.name, split.rooms, "rooms");
    const auto each = [&](int done) {
      bar.update(done);
      stop_if_interrupted(file.string());
    };
    const RoomAssets assets = load_assets(assets_, split.setting);
    if (wish_.write_expected) split.cameras = choose_cameras(device_, manifest_, split, assets, each);
    const RoomFile rooms = make_rooms(manifest_, split, assets, each);
    const std::string hash = hash_of(rooms);
    if (wish_.write_expected) split.rooms_hash = hash;
    if (hash != split.rooms_hash)
      throw usage_error("this program makes other rooms of these seeds",
                        fmt::format("{}: {}", manifest_.file.string(), split.name), hash,
                        split.rooms_hash + ": the program that wrote the manifest, or a new version of the set");
    if (fs::exists(file)) return expect_rooms(file, split);
    write_room_file(file, rooms);
  }

  /// Those of another version are not written over.
  static void expect_rooms(const fs::path& file, const SetSplit& split) {
    if (const std::string found = hash_of(read_room_file(file)); found != split.rooms_hash)
      throw usage_error("holds other rooms", file.string(), found, split.rooms_hash);
  }

  void announce() const {
    std::string text = fmt::format("{}, version {}, {}x{}{}:", manifest_.name, manifest_.version, manifest_.views.width,
                                   manifest_.views.height, manifest_.light.wanted ? ", with light" : "");
    for (const SetSplit& split : manifest_.splits)
      text += fmt::format(" {} {} rooms, {} pairs of picture and maps;", split.name, rooms_of(split),
                          rooms_of(split) * manifest_.views.count);
    say(text + " how long they take is said after the first");
  }

  void trace(const SetSplit& split, GenerateSummary& all) {
    GenerateOptions options = options_of(manifest_, split, wish_.out);
    options.rooms.count = rooms_of(split), options.rooms.assets = assets_, options.mitsuba = wish_.mitsuba;
    options.rooms.shard = wish_.shard, options.rooms.shards = wish_.shards;
    options.interrupted = [] { return interrupted(); };
    const int before = all.views();
    options.progress = [&](int done, int, bool made) {
      if (!made) return;  // as of other sets: the first view builds kernels
      if (!progress_) progress_ = std::make_unique<Progress>(manifest_.name, all_views(), "views", before + done);
      progress_->update(before + done);
    };
    all.add(generate(device_, options));
  }

  void write_expected() {
    for (SetSplit& split : manifest_.splits) {
      const fs::path folder = options_of(manifest_, split, wish_.out).out;
      for (const std::string& room : list_rooms(folder, split.name))
        for (const std::string& id : list_views(folder / room))
          split.views.push_back(measure_view(folder / room, id, manifest_.light.wanted));
    }
    write_file(manifest_.file, manifest_text(manifest_));
    say(fmt::format("{}: what must come out of version {} is written", manifest_.file.string(), manifest_.version));
  }

  void check() const {
    if (wish_.shards > 1)
      return say(fmt::format("when all shards are done: clerestory data check {} --manifest {}", wish_.out.string(),
                             manifest_.file.string()));
    int problems = 0;
    for (const SetSplit& split : manifest_.splits)
      check_split(manifest_, split, wish_.out, rooms_of(split), [&](const fs::path& file, const std::string& what) {
        say(fmt::format("{}: {}", file.string(), what)), ++problems;
      });
    if (problems > 0)
      throw Error(ErrorKind::Failed, "what came out is not the set of the manifest", wish_.out.string(),
                  fmt::format("{} problems", problems), "none");
    say(fmt::format("{}: {}, version {}{}", wish_.out.string(), manifest_.name, manifest_.version,
                    wish_.rooms ? ", as far as it was made" : ", whole"));
  }

  Device device_;
  const SetWish& wish_;
  Manifest manifest_;
  fs::path assets_;
  std::unique_ptr<Progress> progress_;
};

}  // namespace

void refuse_fixed(const CommonOptions& common) {
  const std::vector<std::string> free{"--manifest", "--out",     "--rooms",  "--shard", "--write-expected",
                                      "--assets",   "--mitsuba", "--device", "--json",  "--quiet"};
  for (const std::string& word : common.command) {
    const std::string option = word.substr(0, word.find('='));
    if (option.starts_with("--") && std::ranges::find(free, option) == free.end())
      throw usage_error("has no say: the manifest fixes the set", option, "", "left out beside --manifest");
  }
}

GenerateSummary make_set(const std::string& device, const SetWish& wish) {
  if (wish.out.empty()) throw usage_error("a folder is needed", "--out");
  if (wish.rooms && *wish.rooms < 1)
    throw usage_error("out of range", "--rooms", fmt::format("{}", *wish.rooms), "1 or more");
  for (const auto& [name, given] :
       {std::pair{"--rooms", wish.rooms.has_value()}, std::pair{"--shard", wish.shards > 1}})
    if (wish.write_expected && given)
      throw usage_error("has no say: the first rooms are traced", name, "", "left out beside --write-expected");
  catch_interrupts();
  return SetMaker(Device::open(device), wish).make();
}

}  // namespace clerestory
