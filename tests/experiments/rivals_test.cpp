// Simple rivals on pictures of which the answer is known: Retinex on painted walls under smooth light, the box on a
// box.
#include "experiments/evaluation/rivals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "experiments/evaluation/gradients.hpp"
#include "experiments/evaluation/manhattan.hpp"
#include "experiments/evaluation/metrics.hpp"
#include "experiments/evaluation/retinex.hpp"
#include "experiments/evaluation/room_box.hpp"
#include "experiments/evaluation/summary.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

// ---- Gradients ----

std::vector<double> random_grid(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(normal(random));
  return values;
}

TEST(Gradients, OfAGridGiveTheGridBack) {
  for (const auto& [w, h] : {std::pair{1, 1}, {7, 1}, {5, 4}, {32, 21}}) {
    const std::vector<double> values = random_grid(w * h, 1);
    double mean = 0;
    for (const double v : values) mean += v / (w * h);
    const std::vector<double> back = integrated(gradients_of(values, w, h));
    // Each of four transforms sums up to 32 products; the least eigenvalue, 2 - 2 cos(pi / 32) = 0.0096, divides.
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(back[i], values[i] - mean, 1e-11) << w << "x" << h;
  }
}

TEST(Gradients, OfNoGridGiveTheNearestOne) {
  GridGradients g{6, 5, random_grid(5 * 5, 2), random_grid(6 * 4, 3)};
  const GridGradients found = gradients_of(integrated(g), 6, 5);
  // At the least squared distance what is left over flows neither in nor out of any point.
  std::vector<double> left(30, 0.0);
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 5; ++x) {
      const double rest =
          g.right[static_cast<std::size_t>(y * 5 + x)] - found.right[static_cast<std::size_t>(y * 5 + x)];
      left[static_cast<std::size_t>(y * 6 + x)] -= rest, left[static_cast<std::size_t>(y * 6 + x + 1)] += rest;
    }
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) {
      const double rest = g.down[static_cast<std::size_t>(y * 6 + x)] - found.down[static_cast<std::size_t>(y * 6 + x)];
      left[static_cast<std::size_t>(y * 6 + x)] -= rest, left[static_cast<std::size_t>(y * 6 + x + 6)] += rest;
    }
  for (const double l : left) EXPECT_NEAR(l, 0, 1e-12);
}

// ---- Retinex ----

/// Patches of 8x8 pixels under light that falls off to a quarter across the picture.
struct PaintedWall {
  Image albedo{48, 32, 3}, picture{48, 32, 3};
  explicit PaintedWall(const std::vector<std::array<float, 3>>& paints) {
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 48; ++x) {
        const auto& paint = paints[static_cast<std::size_t>(x / 8 + 3 * (y / 8)) % paints.size()];
        const double light = 0.7 * std::exp(-std::log(4.0) * x / 47 + 0.01 * y);
        for (int c = 0; c < 3; ++c) {
          albedo.at(c, y, x) = paint[static_cast<std::size_t>(c)];
          picture.at(c, y, x) = static_cast<float>(light * static_cast<double>(paint[static_cast<std::size_t>(c)]));
        }
      }
  }
  double error(const Image& answer) const { return *scale_invariant_mse(answer, albedo, Image(48, 32, 1, 1.0f)); }
};

TEST(Retinex, TakesSmoothLightOffPaint) {
  // Steps of light are 0.0295 a pixel, of paint at least ln(0.8 / 0.4) in brightness, or in colour alone.
  for (const std::vector<std::array<float, 3>>& paints :
       {std::vector<std::array<float, 3>>{{0.8f, 0.8f, 0.8f}, {0.4f, 0.4f, 0.4f}},
        std::vector<std::array<float, 3>>{{0.8f, 0.5f, 0.4f}, {0.4f, 0.5f, 0.8f}}}) {
    const PaintedWall wall(paints);
    // Every eighth column keeps its step of light, 0.0295, beside that of paint: of ln 4 an eighth. Errors of
    // logarithms across are (1 / 8)^2 of what they were.
    EXPECT_LT(wall.error(retinex_albedo(wall.picture, {0.1, 0.05})), wall.error(wall.picture) / 32);
    EXPECT_GT(wall.error(wall.picture), 0.02) << "there was no light to take off";
  }
}

TEST(Retinex, ThresholdsSayWhatIsPaint) {
  const PaintedWall grey({{0.8f, 0.8f, 0.8f}, {0.7f, 0.7f, 0.7f}});  // a step of 0.134
  const Image all_light = retinex_albedo(grey.picture, {0.2, 0.2});
  for (const float v : all_light.data) EXPECT_NEAR(v, 1, 1e-6);
  const Image all_paint = retinex_albedo(grey.picture, {0, 0});  // light across too: the picture itself
  const float scale = all_paint.data[0] / grey.picture.data[0];
  for (std::size_t i = 0; i < all_paint.data.size(); ++i)
    EXPECT_NEAR(all_paint.data[i], scale * grey.picture.data[i], 1e-5);
  const PaintedWall coloured({{0.8f, 0.5f, 0.4f}, {0.4f, 0.5f, 0.8f}});  // of equal brightness in logarithms
  EXPECT_LT(coloured.error(retinex_albedo(coloured.picture, {10, 0.05})), 0.001);
  EXPECT_EQ(retinex_albedo(Image(4, 3, 3)).data, Image(4, 3, 3, 1.0f).data) << "a black picture";
}

// ---- The box ----

Mat3 turned(double yaw, double pitch, double roll) {
  const auto degrees = [](double d) { return d * std::numbers::pi / 180; };
  const auto c = [&](double d) { return std::cos(degrees(d)); };
  const auto s = [&](double d) { return std::sin(degrees(d)); };
  const Mat3 about_y(c(yaw), 0, -s(yaw), 0, 1, 0, s(yaw), 0, c(yaw));
  const Mat3 about_x(1, 0, 0, 0, c(pitch), s(pitch), 0, -s(pitch), c(pitch));
  const Mat3 about_z(c(roll), s(roll), 0, -s(roll), c(roll), 0, 0, 0, 1);
  return about_z * about_x * about_y;
}

/// Each face in a grey of its own, by areas: sixteen rays a pixel.
Image painted(const RoomBox& box, const Camera& camera) {
  const float greys[6] = {0.1f, 0.5f, 0.95f, 0.2f, 0.6f, 0.32f};
  const Camera fine = camera.resized(4 * camera.width, 4 * camera.height);
  const BoxMaps maps = maps_of(box, fine);
  Image picture(fine.width, fine.height, 3);
  for (std::size_t i = 0; i < picture.pixels(); ++i)
    for (int c = 0; c < 3; ++c) picture.plane(c)[i] = greys[maps.face[i]];
  return resize_area(picture, camera.width, camera.height);
}

/// The largest angle between an axis of one frame and the nearest of the other, degrees.
double frame_error(const Mat3& a, const Mat3& b) {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    double nearest = 0;
    for (int l = 0; l < 3; ++l) nearest = std::max(nearest, std::abs(glm::dot(a[k], b[l])));
    worst = worse(worst, std::acos(std::min(nearest, 1.0)) * 180 / std::numbers::pi);
  }
  return worst;
}

TEST(RoomBox, MapsAreWhereRaysLeaveTheBox) {
  const Camera camera = Camera::from_fov(61, 41, 90);
  RoomBox box;
  box.plus = {2, 0.7, 1}, box.minus = {1.5, 1, 3};
  const BoxMaps maps = maps_of(box, camera);
  EXPECT_EQ(maps.face[20 * 61 + 30], 5);  // straight ahead: minus backwards
  EXPECT_FLOAT_EQ(maps.depth.at(0, 20, 30), 3);
  EXPECT_FLOAT_EQ(maps.normal.at(2, 20, 30), 1);
  EXPECT_EQ(maps.face[20 * 61 + 0], 1);  // to the left by 30 / 30.5 of the depth
  EXPECT_NEAR(maps.depth.at(0, 20, 0), 1.5 * 30.5 / 30, 1e-6);
  EXPECT_FLOAT_EQ(maps.normal.at(0, 20, 0), 1);
  EXPECT_EQ(maps.face[40 * 61 + 30], 3);  // the floor
  EXPECT_NEAR(maps.depth.at(0, 40, 30), 30.5 / 20, 1e-6);
  EXPECT_FLOAT_EQ(maps.normal.at(1, 40, 30), 1);
}

TEST(RoomBox, LinesOfABoxTellItsDirections) {
  const Camera camera = Camera::from_fov(160, 120, 80);
  for (const auto& [yaw, pitch, roll] : {std::array{25.0, -8.0, 2.0}, {-38.0, 3.0, -1.0}, {16.0, -12.0, 0.0}}) {
    RoomBox box;
    box.axes = turned(yaw, pitch, roll);
    const std::vector<LineSegment> lines = line_segments(painted(box, camera));
    EXPECT_GE(lines.size(), 3u);
    EXPECT_LT(frame_error(manhattan_frame(lines, camera), box.axes), 2) << yaw << " " << pitch << " " << roll;
  }
  const Image grey(160, 120, 3, 0.5f);
  EXPECT_TRUE(line_segments(grey).empty());
  EXPECT_LT(frame_error(manhattan_frame({}, camera), Mat3(1)), 0.2) << "an upright camera that looks ahead";
}

TEST(RoomBox, IsFoundInItsPicture) {
  const Camera camera = Camera::from_fov(160, 120, 80);
  const Image all(160, 120, 1, 1.0f);
  for (const auto& [yaw, left, ceiling, front] :
       {std::array{25.0, 1.1, 0.7, 2.0}, {-30.0, 1.5, 1.0, 4.0}, {18.0, 0.9, 0.8, 3.5}}) {
    RoomBox box;
    box.axes = turned(yaw, -6, 1);
    box.minus = {left, 1, front}, box.plus[1] = ceiling;
    const BoxMaps truth = maps_of(box, camera), found = maps_of(fitted_box(painted(box, camera), camera), camera);
    // Lines are known to a pixel, half a degree, and the axes to two: so are walls, and a pixel along each edge is
    // another's.
    EXPECT_LT(*mean_angle(found.normal, truth.normal, all), 6) << yaw;
    RoomBox typical;
    typical.axes = box.axes;
    EXPECT_LT(*rooted_si_log(found.depth, truth.depth, all),
              0.5 * *rooted_si_log(maps_of(typical, camera).depth, truth.depth, all))
        << yaw << ": the typical box would do";
  }
}

// ---- Beside the trivial predictors ----

PreparedView view_of(const RoomBox& box, const Camera& camera) {
  const BoxMaps maps = maps_of(box, camera);
  PreparedView view;
  view.image = painted(box, camera), view.camera = camera, view.scene_scale = 1;
  view.truth = {view.image, maps.normal, maps.depth, Image(camera.width, camera.height, 2, 0.5f)};
  const Image all(camera.width, camera.height, 1, 1.0f);
  view.masks = {all, all, all};
  return view;
}

TEST(Rivals, AnswerWhatTheyKnow) {
  const Camera camera = Camera::from_fov(160, 120, 80);
  RoomBox box;
  box.axes = turned(20, -5, 0);
  PreparedView view = view_of(box, camera);
  const auto at = [](MapError e) { return static_cast<std::size_t>(e); };
  RivalErrors errors = rival_errors(view);
  EXPECT_EQ(errors[0][at(MapError::Albedo)],
            scale_invariant_mse(retinex_albedo(view.image), view.truth.albedo, view.masks.albedo));
  EXPECT_LT(*errors[1][at(MapError::Normal)], 6);
  EXPECT_LT(*errors[1][at(MapError::Depth)], 0.1);
  for (const MapError e : {MapError::Normal, MapError::Depth, MapError::Roughness, MapError::Metallic})
    EXPECT_FALSE(errors[0][at(e)]);
  for (const MapError e : {MapError::Albedo, MapError::Roughness, MapError::Metallic}) EXPECT_FALSE(errors[1][at(e)]);
  view.camera.reset();
  errors = rival_errors(view);
  EXPECT_FALSE(errors[1][at(MapError::Normal)]) << "no camera, no box";
  EXPECT_TRUE(errors[0][at(MapError::Albedo)]);
}

TEST(Rivals, StandInColumnsOfTheirOwn) {
  ViewResult a, b;
  a.ours[0] = 1, a.constant[0] = 4, b.ours[0] = 3, b.constant[0] = 4;
  a.ours[2] = 0.2, a.constant[2] = 0.1;
  const Table without = summary_table(summarise({a, b}), "t");
  EXPECT_THAT(table_text(without), testing::Not(HasSubstr("rival")));
  EXPECT_EQ(rivals_text(summarise({a, b})), "");
  a.rivals[1][0] = 1, b.rivals[1][0] = 7, a.rivals[0][2] = 0.4;
  const EvaluationSummary s = summarise({a, b});
  EXPECT_DOUBLE_EQ(s.find(MapError::Normal)->ratio, 0.5) << "ratios stay those to trivial predictors";
  EXPECT_DOUBLE_EQ(s.find(MapError::Normal)->rival_ratio, 0.5);
  EXPECT_DOUBLE_EQ(s.find(MapError::Albedo)->rival_ratio, 0.5);
  EXPECT_DOUBLE_EQ(s.find(MapError::Albedo)->ratio, 2);
  EXPECT_DOUBLE_EQ(s.score(), 1);
  EXPECT_EQ(rivals_text(s),
            "best simple rival: normals: box of lines 4, ours over it 0.500; albedo: Retinex 0.4, ours over it 0.500");
  const Table table = summary_table(s, "t");
  ASSERT_EQ(table.columns.size(), without.columns.size() + 3);
  EXPECT_EQ(cell_text(table.rows[0][8], table.columns[8]), "-");
  EXPECT_EQ(std::get<Measure>(table.rows[0][9]).mean, 4);
  b.rivals[1][0].reset();
  EXPECT_FALSE(summarise({a, b}).find(MapError::Normal)->best_rival) << "it answers one view of two";
}

TEST(Rivals, ThePreparedCameraSeesThePreparedPixels) {
  RoomView view;
  view.camera = Camera::from_fov(200, 100, 80);
  view.camera->cx = 97;
  view.image = Image(200, 100, 3, 0.5f), view.albedo = Image(200, 100, 3, 0.5f),
  view.material = Image(200, 100, 3, 0.5f);
  view.normal = Image(200, 100, 3), view.depth = Image(200, 100, 1, 1.0f), view.mask = Image(200, 100, 1, 1.0f);
  const PreparedView prepared = prepare_view(view, 40, 30);  // the middle 133 columns
  ASSERT_TRUE(prepared.camera);
  EXPECT_EQ(prepared.camera->width, 40);
  const double left = (200 - 133) / 2;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {40.0, 30.0}, {13.0, 7.0}}) {
    const Vec3 here = prepared.camera->ray(x, y), there = view.camera->ray(left + x * 133 / 40, y * 100 / 30);
    EXPECT_NEAR(here.x, there.x, 1e-12);
    EXPECT_NEAR(here.y, there.y, 1e-12);
  }
}

}  // namespace
}  // namespace clerestory
