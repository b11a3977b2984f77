// Errors along the edges of maps: where edges are, and that true maps of the picture's own size have none.
#include "experiments/studies/edge_study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "experiments/applications/predict.hpp"
#include "experiments/evaluation/edge_band.hpp"
#include "host/report/table.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 12, kHeight = 5, kStep = 6;  // maps step between columns kStep - 1 and kStep

struct StepMaps {
  MapSet maps{Image(kWidth, kHeight, 3, 0.5f), Image(kWidth, kHeight, 3), Image(kWidth, kHeight, 1, 2),
              Image(kWidth, kHeight, 2, 0.3f)};
  Image all{kWidth, kHeight, 1, 1};
  MapMasks masks{all, all, all};

  StepMaps() { turn(0); }
  /// Calls set(pixel) for all pixels behind the step.
  template <class Set>
  void behind(const Set& set) {
    for (int i = 0; i < kWidth * kHeight; ++i)
      if (i % kWidth >= kStep) set(i);
  }
  void turn(double degrees) {
    std::ranges::fill(std::span(maps.normal.plane(2), maps.normal.pixels()), 1.0f);
    behind([&](int i) {
      maps.normal.plane(0)[i] = static_cast<float>(std::sin(degrees * std::numbers::pi / 180));
      maps.normal.plane(2)[i] = static_cast<float>(std::cos(degrees * std::numbers::pi / 180));
    });
  }
  MapMasks bands(int reach = 1) const { return edge_bands(maps, masks, reach); }
};

int count(const Image& mask) { return static_cast<int>(std::ranges::count(mask.data, 1.0f)); }

TEST(EdgeBands, LieAroundStepsOfEachMap) {
  StepMaps s;
  for (const Image& band : {s.bands().geometry, s.bands().albedo, s.bands().material}) EXPECT_EQ(count(band), 0);
  s.behind([&](int i) { s.maps.albedo.plane(2)[i] = 0.39f, s.maps.material.plane(1)[i] = 0.41f; });
  for (const Image& band : {s.bands().albedo, s.bands().material}) {
    EXPECT_EQ(count(band), 4 * kHeight) << "a pixel on each side, and one more by reach";
    for (int x = 0; x < kWidth; ++x) EXPECT_EQ(band.at(0, 2, x) > 0, x >= kStep - 2 && x < kStep + 2) << x;
  }
  EXPECT_EQ(count(s.bands(0).albedo), 2 * kHeight);
  EXPECT_EQ(count(s.bands().geometry), 0);
  s.behind([&](int i) { s.maps.albedo.plane(2)[i] = 0.41f; });
  EXPECT_EQ(count(s.bands().albedo), 0) << "less than edge_albedo";
}

TEST(EdgeBands, NormalsTurnAndDepthGrows) {
  StepMaps s;
  s.turn(edge_degrees - 0.1);
  EXPECT_EQ(count(s.bands().geometry), 0);
  s.turn(edge_degrees + 0.1);
  EXPECT_EQ(count(s.bands().geometry), 4 * kHeight);
  s.turn(0);
  for (const auto& [depth, found] : {std::pair{2.09f, false}, {2.11f, true}, {1.91f, false}, {1.89f, true}}) {
    s.behind([&, d = depth](int i) { s.maps.depth.data[i] = d; });
    EXPECT_EQ(count(s.bands().geometry) > 0, found) << depth;
  }
}

// A hole is no edge, and nothing in it is judged.
TEST(EdgeBands, StayWithinTheMask) {
  StepMaps s;
  s.behind([&](int i) { s.maps.depth.data[i] = 0, s.masks.geometry.data[i] = 0; });
  EXPECT_EQ(count(s.bands().geometry), 0);
  s.turn(90);
  s.masks.geometry = Image(kWidth, kHeight, 1, 1);
  for (int x = 0; x < kWidth; ++x) s.masks.geometry.at(0, 0, x) = 0;
  const MapMasks bands = s.bands();
  EXPECT_EQ(count(bands.geometry), 4 * (kHeight - 1));
  EXPECT_EQ(count(without(s.masks, bands).geometry), (kWidth - 4) * (kHeight - 1));
  EXPECT_EQ(count(without(s.masks, bands).albedo), kWidth * kHeight);
}

TEST(Enlarged, FillsHolesFromWhatIsKnown) {
  Device device = Device::open();
  Image map(4, 3, 1, 0.75f), mask(4, 3, 1, 1), small(4, 3, 3, 0.5f), photo(16, 12, 3, 0.5f);
  map.at(0, 1, 1) = 100, mask.at(0, 1, 1) = 0;
  for (const float v : enlarged(device, map, mask, small, photo).data)
    EXPECT_NEAR(v, 0.75f, 4e-7f);  // a sum of 16 rounded products over one of 16 terms
}

TEST(EdgeStudy, TrueMapsOfThePicturesSizeAreRight) {
  ScratchFolder folder("clerestory-edge-study");
  const fs::path said = folder / "said.txt";
  const std::vector<std::string> words{"run",
                                       std::string(CLERESTORY_SOURCE_DIR) + "/experiments/configs/edges.toml",
                                       "run.root=" + folder.path().string(),
                                       "data.rooms=1",
                                       "data.width=96",
                                       "data.height=72",
                                       "data.spp=4",
                                       "edges.small_width=96"};
  ASSERT_EQ(Program(words, said).wait(), 0) << text_of(said);
  for (const auto& run : fs::directory_iterator(folder / "edges")) {
    const Table table = table_from_json(text_of(run.path() / "artifacts/edges.table.json"), "edges");
    ASSERT_EQ(table.rows.size(), 5u);
    for (const std::vector<Cell>& row : table.rows) {
      const auto value = [&](std::size_t column) { return std::get<Measure>(row[column]).mean; };
      EXPECT_GT(value(1), 0) << std::get<std::string>(row[0]);
      EXPECT_LT(value(3), 1e-6)
          << "the nearest pixel of the truth is the truth";  // of angles: rounding of unit vectors
      EXPECT_GT(value(2), value(3)) << "a bilateral blurs";
    }
  }
}

}  // namespace
}  // namespace clerestory
