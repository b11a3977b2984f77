// The register tile of a device: measured once, remembered, measured again where the memory of it is damaged; refused
// where it computes wrongly; forced by name.
#include "host/cl/tile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

/// The remembered tile's file.
std::filesystem::path entry(const ScopedFolder& cache) {
  for (const auto& file : std::filesystem::directory_iterator(cache.path() / "clerestory"))
    if (file.path().filename().string().starts_with("tile-")) return file.path();
  return {};
}

TEST(Tile, FitsTheRegistersItIsMadeFor) {
  ASSERT_GE(tiles().size(), 2u);
  for (const Tile& tile : tiles()) {
    const int positions = 3 * tile.width, registers = tile.rows * 3 + 3 + 1;
    EXPECT_EQ(tile.name, fmt::format("{}x{}", tile.rows, positions));
    EXPECT_EQ(8 % tile.rows, 0) << "a panel of weights has 8 rows";
    EXPECT_EQ(48 % positions, 0) << "a work-item of mlp.clh has 48 rays";
    EXPECT_LE(registers, tile.rows == 8 ? 32 : 16) << tile.name;
  }
}

TEST(Tile, EveryOneThatTheDeviceMayUseComputesRightly) {
  Device device = Device::open();
  const std::vector<TileSpeed> speeds = measure_tiles(device);
  ASSERT_FALSE(speeds.empty());
  for (const TileSpeed& speed : speeds) {
    EXPECT_EQ(speed.fault, "") << speed.tile.name;
    EXPECT_GT(speed.gflops, 0) << speed.tile.name;
    EXPECT_LE(speed.tile.width, std::max(4, device.info().float_width)) << speed.tile.name;
  }
  EXPECT_EQ(device.memory_now(), 0u);
}

TEST(Tile, IsMeasuredOnceAndRemembered) {
  ScopedFolder cache;
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string());
  Device first = Device::open();
  const std::string name = first.tile().name;
  const int after = first.builds();
  EXPECT_EQ(first.tile().name, name);
  EXPECT_EQ(first.builds(), after);
  Device second = Device::open();
  EXPECT_EQ(second.tile().name, name);
  EXPECT_EQ(second.builds(), 0) << "it was measured again";
}

// What the cache holds is taken: a name that is no tile, or a file that is damaged, is not.
TEST(Tile, ADamagedEntryIsMeasuredAnew) {
  ScopedFolder cache;
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string());
  Device::open().tile();
  const std::filesystem::path file = entry(cache);
  const std::string whole = read_text(file);
  for (const std::string& text : {std::string("damaged"), whole.substr(0, whole.size() - 1), std::string()}) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
    Device device = Device::open();
    EXPECT_NO_THROW(device.tile());
    EXPECT_GT(device.builds(), 0) << "not measured: \"" << text << '"';
    // Another measurement may find another tile, but the file is whole again.
    Device next = Device::open();
    EXPECT_EQ(next.tile().name, device.tile().name);
    EXPECT_EQ(next.builds(), 0);
  }
}

TEST(Tile, IsForcedByName) {
  Device device = Device::open();
  const std::string fastest = device.tile().name;
  for (const Tile& tile : tiles()) {
    device.use_tile(tile.name);
    EXPECT_EQ(device.tile().name, tile.name);
    EXPECT_EQ(tile_defines(device),
              (Defines{{"TILE_ROWS", std::to_string(tile.rows)}, {"TILE_WIDTH", std::to_string(tile.width)}}));
  }
  device.use_tile("auto");
  EXPECT_EQ(device.tile().name, fastest);
  EXPECT_THAT(message_of<Error>([&] { device.use_tile("9x9"); }), HasSubstr("auto, 8x48, 8x24, 4x24, 8x12, 4x12"));
}

// A compiler that breaks tiles of 8 rows: those are refused, however fast.
TEST(Tile, OneThatComputesWronglyIsNotChosen) {
  ScopedFolder cache, kernels;
  std::filesystem::copy(std::string(CLERESTORY_SOURCE_DIR) + "/kernels", kernels.path(),
                        std::filesystem::copy_options::recursive);
  std::string text = read_text(kernels.path() / "tensor/tile.cl");
  const std::string call = "sum, depth,";
  ASSERT_NE(text.find(call), std::string::npos);
  text.replace(text.find(call), call.size(), "sum, depth - (TILE_ROWS == 8),");
  kernels.write("tensor/tile.cl", text);
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string()), folder("CLERESTORY_KERNELS", kernels.string());
  Device device = Device::open();
  const std::vector<TileSpeed> speeds = measure_tiles(device);
  EXPECT_EQ(speeds.size(), tiles().size());
  for (const TileSpeed& speed : speeds) {
    EXPECT_EQ(speed.fault.empty(), speed.tile.rows == 4) << speed.tile.name << ": " << speed.fault;
    if (speed.tile.rows == 8) {
      EXPECT_THAT(speed.fault, HasSubstr("a product of whole numbers gives"));
    }
  }
  EXPECT_EQ(device.tile().rows, 4);
}

}  // namespace
}  // namespace clerestory
