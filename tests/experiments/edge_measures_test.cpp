// Errors of trained maps along the edges of true ones, on maps whose errors are known.
#include "experiments/studies/edge_measures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clerestory {
namespace {

constexpr int kWidth = 16, kHeight = 5, kStep = 8;  // maps step between columns kStep - 1 and kStep
constexpr int kBand = 8;                            // columns within three pixels of those two

/// Columns from `first` on get these numbers, by channel.
void fill(Image& map, const std::vector<double>& values, int first = 0) {
  for (int c = 0; c < map.channels; ++c)
    for (int y = 0; y < map.height; ++y)
      for (int x = first; x < map.width; ++x) map.at(c, y, x) = static_cast<float>(values[static_cast<std::size_t>(c)]);
}

/// All maps of one value, or with a step of each.
MapSet true_maps(bool step) {
  MapSet maps{Image(kWidth, kHeight, 3), Image(kWidth, kHeight, 3), Image(kWidth, kHeight, 1),
              Image(kWidth, kHeight, 2)};
  fill(maps.albedo, {0.25, 0.25, 0.25}), fill(maps.normal, {0, 0, 1}), fill(maps.depth, {0.5});
  fill(maps.material, {0.25, 0});
  if (!step) return maps;
  fill(maps.albedo, {0.75, 0.75, 0.75}, kStep), fill(maps.normal, {1, 0, 0}, kStep), fill(maps.depth, {1}, kStep);
  fill(maps.material, {0.75, 1}, kStep);
  return maps;
}

MapMasks everywhere() {
  const Image all(kWidth, kHeight, 1, 1);
  return {all, all, all};
}

/// Roughness is wrong by a half beside the edge and by a quarter at the border, metallic by a tenth everywhere; normals
/// are turned by 30 degrees beside the edge; albedo and depth have another scale.
MapSet wrong_maps() {
  MapSet maps = true_maps(true);
  for (float& v : maps.albedo.data) v *= 0.5f;
  for (float& v : maps.depth.data) v *= 3;
  for (float& v : std::span(maps.material.plane(1), maps.material.pixels())) v += 0.1f;
  constexpr double angle = 30 * std::numbers::pi / 180;
  for (int y = 0; y < kHeight; ++y) {
    maps.material.at(0, y, kStep) += 0.5f, maps.material.at(0, y, 0) += 0.25f;
    maps.normal.at(0, y, kStep) = static_cast<float>(std::cos(angle));
    maps.normal.at(1, y, kStep) = static_cast<float>(std::sin(angle));
  }
  return maps;
}

double at(const MapErrors& errors, MapError which) { return errors.at(static_cast<std::size_t>(which)).value_or(NAN); }

TEST(EdgeMeasures, ErrorsAreTakenApartAtThreePixels) {
  const EdgeErrors e = edge_errors("rooms/a/000", wrong_maps(), true_maps(true), everywhere());
  EXPECT_EQ(e.width, kWidth);
  EXPECT_EQ(e.height, kHeight);
  // Maps are in float; a column of eight is wrong on either side.
  EXPECT_NEAR(at(e.along, MapError::Roughness), 0.25 / kBand, 1e-7);
  EXPECT_NEAR(at(e.elsewhere, MapError::Roughness), 0.0625 / kBand, 1e-7);
  EXPECT_NEAR(at(e.along, MapError::Metallic), 0.01, 1e-7);
  EXPECT_NEAR(at(e.elsewhere, MapError::Metallic), 0.01, 1e-7);
  EXPECT_NEAR(at(e.along, MapError::Normal), 30.0 / kBand, 1e-4);  // degrees of an arc cosine of floats
  EXPECT_NEAR(at(e.elsewhere, MapError::Normal), 0, 1e-4);
  for (const MapError map : {MapError::Albedo, MapError::Depth}) {
    EXPECT_NEAR(at(e.along, map), 0, 1e-6) << "a scale is free";
    EXPECT_NEAR(at(e.elsewhere, map), 0, 1e-6);
  }
}

// The band's last column is the third from the step on either side.
TEST(EdgeMeasures, TheBandEndsAfterThreeMorePixels) {
  for (const auto& [column, along] :
       {std::pair{kStep - 5, false}, {kStep - 4, true}, {kStep + 3, true}, {kStep + 4, false}}) {
    MapSet maps = true_maps(true);
    for (int y = 0; y < kHeight; ++y) maps.material.at(0, y, column) += 0.5f;
    const EdgeErrors e = edge_errors("rooms/a/000", maps, true_maps(true), everywhere());
    EXPECT_EQ(at(e.along, MapError::Roughness) > 0, along) << column;
    EXPECT_EQ(at(e.elsewhere, MapError::Roughness) > 0, !along) << column;
  }
}

TEST(EdgeMeasures, ViewsWithoutEdgesDoNotCountAlongThem) {
  MapSet rough = true_maps(false);
  for (float& v : rough.material.data) v += 0.5f;
  const std::vector<EdgeErrors> views{edge_errors("rooms/a/000", wrong_maps(), true_maps(true), everywhere()),
                                      edge_errors("rooms/b/000", rough, true_maps(false), everywhere())};
  const Table table = edge_table(views);
  ASSERT_EQ(table.columns.size(), 3u);
  ASSERT_EQ(table.rows.size(), 5u);
  EXPECT_THAT(table.note, testing::HasSubstr("16x5"));
  const std::vector<Cell>& roughness = table.rows[static_cast<std::size_t>(MapError::Roughness)];
  EXPECT_EQ(std::get<std::string>(roughness[0]), "roughness, MSE");
  EXPECT_NEAR(std::get<Measure>(roughness[1]).mean, 0.25 / kBand, 1e-7);
  EXPECT_NEAR(std::get<Measure>(roughness[2]).mean, (0.0625 / kBand + 0.25) / 2, 1e-7);

  const std::vector<JudgedErrorsList> lists = edge_lists(views);
  ASSERT_EQ(lists.size(), 2u);
  EXPECT_EQ(lists[0].list, "along edges");
  EXPECT_EQ(lists[0].views.at(1).room, "b");
  constexpr auto which = static_cast<std::size_t>(MapError::Roughness);
  EXPECT_NEAR(lists[0].views[0].errors.at(which), 0.25 / kBand, 1e-7);
  EXPECT_TRUE(std::isnan(lists[0].views[1].errors.at(which)));
  EXPECT_NEAR(lists[1].views[1].errors.at(which), 0.25, 1e-7);

  const Table none = edge_table({views[1]});
  EXPECT_TRUE(std::holds_alternative<std::monostate>(none.rows[0][1]));
}

}  // namespace
}  // namespace clerestory
