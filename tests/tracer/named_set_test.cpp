// Data sets with a name: the same bytes again, and that a folder which is another set is found out, file by file, but
// not one whose pixels are another device's.
#include "tracer/named_set.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <half.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <map>

#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "tests/tracer/scenes.hpp"
#include "tests/tracer/small_manifest.hpp"
#include "tracer/random.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const fs::path kAssets = fs::path(CLERESTORY_SOURCE_DIR) / "assets";

TEST(ChosenViews, AreThoseThatWereChosen) {
  const RoomAssets assets = load_assets(kAssets, Setting::Training);
  const Handling handling{5, 0.5};
  std::vector<int> all;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Room room = make_room(seed, Setting::Training, assets);
    TraceScene scene(test_device(), room.scene);
    std::vector<int> chosen;
    const std::vector<Camera> cameras = choose_views(scene, room, 4, 32, 24, Random(seed), handling, &chosen);
    EXPECT_EQ(chosen_views(room, chosen, 32, 24, Random(seed), handling), cameras);
    all.insert(all.end(), chosen.begin(), chosen.end());
  }
  EXPECT_THAT(all, testing::Contains(testing::Ge(2))) << "no later candidate was chosen";
}

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      all[fs::relative(entry.path(), folder).string()] = read_file(entry.path(), 1 << 28, true);
  return all;
}

/// The set is made once; each test damages a copy of its own.
struct NamedSet : testing::Test {
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "clerestory-named-set-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root = name;
    write_file(root / "set.toml", kSmallManifest);
    manifest = read_manifest(root / "set.toml", false);
    for (SetSplit& split : manifest.splits) {
      const RoomAssets assets = load_assets(kAssets, split.setting);
      split.cameras = choose_cameras(test_device(), manifest, split, assets);
      split.rooms_hash = hash_of(make_rooms(manifest, split, assets));
    }
    make(root / "whole");
    for (SetSplit& split : manifest.splits)
      for (int i = 0; i < split.rooms; ++i)
        for (const char* id : {"000", "001"})
          split.views.push_back(measure_view(room_of(root / "whole", split, i), id, true));
  }
  static void TearDownTestSuite() { fs::remove_all(root); }

  static fs::path room_of(const fs::path& dir, const SetSplit& split, int index) {
    GenerateOptions naming;
    naming.rooms.seed = split.seed, naming.rooms.setting = split.setting;
    return dir / split.name / room_name(naming, index);
  }
  static void make(const fs::path& dir) {
    make_directories(dir);
    for (const SetSplit& split : manifest.splits) {
      write_room_file(rooms_of_split(dir, split), make_rooms(manifest, split, load_assets(kAssets, split.setting)));
      GenerateOptions options = options_of(manifest, split, dir);
      options.rooms.assets = kAssets;
      generate(test_device(), options);
    }
  }

  void SetUp() override {
    dir = root / "copy", room = room_of(dir, manifest.splits[0], 0);
    fs::copy(root / "whole", dir, fs::copy_options::recursive);
  }
  void TearDown() override { fs::remove_all(dir); }

  /// "FILE: WHAT", the file by its name below the set.
  std::vector<std::string> problems() const {
    std::vector<std::string> all;
    for (const SetSplit& split : manifest.splits)
      check_split(manifest, split, dir, split.rooms, [&](const fs::path& file, const std::string& what) {
        all.push_back(fs::relative(file, dir).string() + ": " + what);
      });
    return all;
  }
  template <class Change>
  void change(const char* map, ExrType type, Change&& value) const {
    Image image = read_map(view_file(room, "000", map), std::string(map) == "depth" ? 1 : 3);
    for (float& v : image.data) v = value(v);
    write_exr(view_file(room, "000", map), image, type);
  }

  static inline fs::path root;
  static inline Manifest manifest;
  fs::path dir, room;
};

TEST_F(NamedSet, IsMadeInTheSameBytes) {
  EXPECT_THAT(problems(), IsEmpty());
  fs::remove_all(dir);
  make(dir);
  EXPECT_EQ(contents(dir), contents(root / "whole"));
}

TEST_F(NamedSet, ARuleThatChangesGivesAnotherHash) {
  SetSplit split = manifest.splits[0];
  const RoomAssets assets = load_assets(kAssets, split.setting);
  RoomFile rooms = make_rooms(manifest, split, assets);
  EXPECT_EQ(hash_of(rooms), split.rooms_hash);
  rooms.rooms[2].materials.back().roughness_a += 0x1p-20f;
  EXPECT_NE(hash_of(rooms), split.rooms_hash);
  split.cameras[1] ^= 1;
  EXPECT_NE(hash_of(make_rooms(manifest, split, assets)), split.rooms_hash);
  write_room_file(rooms_of_split(dir, split), rooms);
  EXPECT_THAT(problems(), ElementsAre(AllOf(HasSubstr("train.rooms: other rooms"), HasSubstr(split.rooms_hash)),
                                      HasSubstr("train/generate.json: from_rooms is")));
}

TEST_F(NamedSet, WhatIsMissingOrTooMuchIsNamed) {
  const std::string name = room.filename().string();
  fs::remove(view_file(room, "001", "im"));
  fs::remove(view_file(room, "000", "envmap"));
  fs::copy(view_file(room, "000", "im"), view_file(room, "002", "im"));
  fs::remove_all(room_of(dir, manifest.splits[0], 1));
  EXPECT_THAT(problems(), ElementsAre(AllOf(HasSubstr("train/train.txt: room"), HasSubstr("00001 is missing")),
                                      HasSubstr(name + "/001_im.exr: the view is missing"),
                                      HasSubstr(name + "/002_im.exr: the view is none of the set"),
                                      HasSubstr(name + "/000_envmap.exr: the view has no light")));
}

// Of most rooms no mean is taken: all files of all views are read.
TEST_F(NamedSet, FilesThatCannotBeReadAreNamed) {
  const Manifest measured = manifest;
  for (SetSplit& split : manifest.splits) split.views.clear();
  for (const std::string file :
       {"001_depth.exr", "001_mask.exr", "001_normal.exr", "001_camera.json", "001_emission.exr", "001_variance.exr",
        "001_probes.json", "001_probe_00.exr", "001_envmap.exr"}) {
    ASSERT_TRUE(fs::exists(room / file)) << file;
    const std::string whole = read_file(room / file, 1 << 28, true);
    write_file(room / file, whole.substr(0, whole.size() / 2));
    EXPECT_THAT(problems(), testing::Contains(HasSubstr(file))) << "half of it";
    fs::remove(room / file);
    EXPECT_THAT(problems(), testing::Contains(HasSubstr(file))) << "nothing of it";
    write_file(room / file, whole);
  }
  EXPECT_THAT(problems(), IsEmpty());
  manifest = measured;
}

// Panoramas and models are those that the manifest says, not what this program comes with.
TEST_F(NamedSet, OfOtherAssetsIsRightWhereTheManifestSaysSo) {
  Manifest other = manifest;
  other.assets_hash = "0123456789abcdef";
  const auto check = [&] {
    std::vector<std::string> all;
    check_split(other, other.splits[0], dir, 0, [&](const fs::path&, const std::string& what) { all.push_back(what); });
    return all;
  };
  EXPECT_THAT(check(), testing::Contains(HasSubstr("expected \"0123456789abcdef\"")));
  const fs::path file = dir / "train/generate.json";
  std::string recipe = read_file(file);
  const std::size_t at = recipe.find("\"assets\": \"") + 11;
  write_file(file, recipe.replace(at, recipe.find('"', at) - at, "0123456789abcdef"));
  EXPECT_THAT(check(), testing::Not(testing::Contains(HasSubstr("assets is"))));
}

TEST_F(NamedSet, RoomsOfOthersAndOtherOptionsAreNamed) {
  fs::create_directories(dir / "test/theirs");
  write_file(dir / "test/test.txt", read_file(dir / "test/test.txt") + "theirs\n");
  std::string recipe = read_file(dir / "test/generate.json");
  recipe.replace(recipe.find("\"spp\": 4"), 8, "\"spp\": 8");
  write_file(dir / "test/generate.json", recipe);
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("test/generate.json: spp is 8; expected 4"),
                                      HasSubstr("test/test.txt: room theirs is none of the set")));
}

TEST_F(NamedSet, AMapThatIsChangedIsFound) {
  for (const auto& [map, factor] :
       {std::pair{"albedo", 0.98f}, {"material", 1.02f}, {"depth", 1.02f}, {"im", 2.0f}, {"envmap", 1.5f}}) {
    const fs::path file = view_file(room, "000", map);
    const std::string whole = read_file(file);
    change(map, ExrType::Float, [&](float v) { return factor * v; });
    EXPECT_THAT(problems(), testing::Contains(HasSubstr(file.filename().string() + ": the mean of"))) << map;
    write_file(file, whole);
  }
  EXPECT_THAT(problems(), IsEmpty());
}

// Every value of a map rounded to the next half in the same direction: no device does worse.
TEST_F(NamedSet, RoundingsOfAnotherDeviceAreNoChange) {
  for (const char* map : {"albedo", "material", "im", "envmap"})
    change(map, ExrType::Half, [](float v) {
      half h(v);
      if (v > 0 && v < 1) h.setBits(static_cast<unsigned short>(h.bits() + 1));
      return static_cast<float>(h);
    });
  for (const char* map : {"depth", "normal"})
    change(map, ExrType::Float, [](float v) { return std::nextafter(v, 1e9f); });
  EXPECT_THAT(problems(), IsEmpty());
}

// Where all pixels are alike nothing but rounding is allowed for: a step of half, but not two.
TEST_F(NamedSet, AStepOfHalfIsAllowedFor) {
  const auto measured = [&](int steps) {
    half h(0.26f);
    h.setBits(static_cast<unsigned short>(h.bits() + steps));
    RoomView view;
    view.image = view.albedo = view.material = Image(8, 6, 3, static_cast<float>(h));
    view.mask = Image(8, 6, 1, 1), view.depth = Image(8, 6, 1, 2), view.normal = Image(8, 6, 3);
    std::fill_n(view.normal.plane(2), view.normal.pixels(), 1.0f);
    write_exr(view_file(dir, "000", "variance"), Image(8, 6, 3), ExrType::Float);
    write_view(dir, "000", view);
    return measure_view(dir, "000", false);
  };
  const ViewMeans right = measured(0), one = measured(1), two = measured(2);
  for (const ViewMean mean : {ViewMean::Albedo, ViewMean::Roughness, ViewMean::Metallic, ViewMean::Radiance}) {
    const auto k = static_cast<std::size_t>(mean);
    EXPECT_LE(std::abs(one[k].value - right[k].value), right[k].within) << key_of(mean);
    EXPECT_GT(std::abs(two[k].value - right[k].value), right[k].within) << key_of(mean);
  }
}

// The same rooms and cameras with other random numbers: the worst that another device can do to a picture.
TEST_F(NamedSet, NoiseIsNoChange) {
  fs::remove_all(dir);
  make_directories(dir);
  for (const SetSplit& split : manifest.splits) {
    RoomFile rooms = make_rooms(manifest, split, load_assets(kAssets, split.setting));
    for (RoomDescription& r : rooms.rooms) r.seed += 1000;
    write_room_file(rooms_of_split(dir, split), rooms);
    GenerateOptions options = options_of(manifest, split, dir);
    options.rooms.assets = kAssets;
    generate(test_device(), options);
  }
  EXPECT_THAT(problems(), testing::Each(testing::Not(HasSubstr("the mean of"))));
  EXPECT_NE(read_file(view_file(room, "000", "im")),
            read_file(view_file(room_of(root / "whole", manifest.splits[0], 0), "000", "im")));
}

}  // namespace
}  // namespace clerestory
