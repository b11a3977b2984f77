// Screen-space rays against brute force over all cells, solver against solver, and the promises of the contract: mirror
// symmetry, rays along axes, starts outside of the frustum, holes, skipping, thickness, facing, batches.
#include "host/ops/light/ssrt.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "checks/light/brute_force.hpp"
#include "checks/light/ssrt_scenes.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/bench_room.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

using namespace ssrt_scenes;

std::vector<Tensor> run(const Scene& scene, const Rays& rays, const SsrtOptions& options, bool facing,
                        Precision precision) {
  Graph g;
  const Value depth = g.input("depth", scene.depth.shape);
  RayOrigins origins;
  Tensors feeds{{"depth", scene.depth},
                {"camera", scene.cameras()},
                {"range", depth_range(scene.depth)},
                {"directions", rays.directions}};
  if (!rays.points.real.empty()) {
    origins = {g.input("points", rays.points.shape), g.input("skip", rays.skip.shape, Type::Int), rays.of_pixels};
    feeds["points"] = rays.points, feeds["skip"] = rays.skip;
  }
  Value normal;
  if (facing) normal = g.input("normal", scene.normal.shape), feeds["normal"] = scene.normal;
  const SsrtHits hits = ssrt(ssrt_scene(depth, normal), g.input("camera", {scene.depth.shape.n, 4, 1, 1}),
                             g.input("range", {scene.depth.shape.n, 3, 1, 1}),
                             g.input("directions", rays.directions.shape), origins, options);
  return evaluate(g, {hits.pixel, hits.delta, hits.u}, test_device(precision), feeds, {.precision = precision});
}

/// Counts of a comparison with brute force.
struct Comparison {
  int rays = 0, hits = 0, differ = 0;
};

Comparison compare(const Scene& scene, const Rays& rays, const SsrtOptions& options, bool facing, Precision precision) {
  const std::vector<Tensor> got = run(scene, rays, options, facing, precision);
  const Shape& s = scene.depth.shape;
  BruteForce reference{scene.camera, &scene.depth, facing ? &scene.normal : nullptr, 0, options.thickness};
  const Tensor range = depth_range(scene.depth);
  Comparison result;
  const bool own = rays.points.real.empty(), map = rays.of_pixels;
  for (int p = 0; p < rays.directions.shape.h; ++p)
    for (int k = 0; k < 16; ++k) {
      const auto plane = static_cast<int>(s.plane());
      const int n = std::min(p / plane, s.n - 1), pixel = p - n * plane;
      reference.item = n;
      Vec3 origin;
      int skip = pixel;
      if (own) {
        const double z = scene.depth.at(n, 0, pixel / s.w, pixel % s.w);
        if (z == 0) {  // nothing to start from
          EXPECT_EQ(got[0].integer[static_cast<std::size_t>(p * 16 + k)], -1);
          EXPECT_EQ(got[2].at(0, 0, p, k), 0);
          continue;
        }
        origin = scene.camera.unproject(pixel % s.w + 0.5, pixel / s.w + 0.5, z);
      } else if (map) {
        for (int c = 0; c < 3; ++c) origin[c] = rays.points.at(n, c, pixel / s.w, pixel % s.w);
        skip = rays.skip.integer[static_cast<std::size_t>(p)];
      } else {
        for (int c = 0; c < 3; ++c) origin[c] = rays.points.at(0, c, p, k);
        skip = rays.skip.integer[static_cast<std::size_t>(p * 16 + k)];
      }
      const Vec3 d{rays.directions.at(0, 0, p, k), rays.directions.at(0, 1, p, k), rays.directions.at(0, 2, p, k)};
      const BruteForce::Hit want = reference.trace(origin, d, skip);
      const int pixel_got = got[0].integer[static_cast<std::size_t>(p * 16 + k)];
      ++result.rays;
      result.hits += want.pixel >= 0;
      const double gap = gap_of(want, range, n, options.delta);
      const double delta = got[1].at(0, 0, p, k), u = got[2].at(0, 0, p, k);
      // Depth where the ray enters: relative to the deepest thing there is, amplified where a ray almost passes the
      // eye.
      const bool same =
          pixel_got == want.pixel &&
          std::abs(delta - gap) <= 1e3 * (precision == Precision::Single ? 1.2e-7 : 2.3e-16) * (1 + 10 * gap);
      if (!same) {
        ++result.differ;
        if (precision == Precision::Double)
          ADD_FAILURE() << "ray " << p << "/" << k << " hits " << pixel_got << " at " << delta << ", brute force "
                        << want.pixel << " at " << gap;
      }
      if (d == Vec3(0))
        EXPECT_EQ(u, 0);
      else
        EXPECT_NEAR(u, pixel_got < 0 ? 1.0 : std::tanh(10 * delta), 6 * kFloatRounding);  // OpenCL allows tanh five
    }
  return result;
}

/// The same in both precisions and by both solvers. In double every ray agrees; in float a ray in a thousand may pass a
/// corner of a cell, or the rim of a depth, on the other side.
void expect_brute_force(const Scene& scene, const Rays& rays, SsrtOptions options = {}, bool facing = false) {
  for (const SsrtSolver solver : {SsrtSolver::Dda, SsrtSolver::Hierarchical}) {
    options.solver = solver;
    const Comparison twice = compare(scene, rays, options, facing, Precision::Double);
    const Comparison single = compare(scene, rays, options, facing, Precision::Single);
    EXPECT_GT(twice.hits, twice.rays / 50);
    EXPECT_LE(single.differ, 1 + single.rays / 500);
  }
}

TEST(Ssrt, EqualsBruteForceFromSurfaces) {
  const Scene scene = scene_of(1, 21, 27, 1);
  expect_brute_force(scene, {directions(21 * 27, 2), {}, {}});
}

TEST(Ssrt, EqualsBruteForceWithFacingAndThickness) {
  const Scene scene = scene_of(1, 18, 23, 3);
  expect_brute_force(scene, {directions(18 * 23, 4), {}, {}}, {}, true);
  expect_brute_force(scene, {directions(18 * 23, 5), {}, {}}, {.thickness = 0.3}, false);
}

TEST(Ssrt, EqualsBruteForceInWindowDepth) {
  const Scene scene = scene_of(1, 18, 23, 24);
  expect_brute_force(scene, {directions(18 * 23, 25), {}, {}}, {.delta = DeltaDepth::Window});
  const Scene batch = scene_of(2, 9, 14, 26);  // each picture has a range of its own
  expect_brute_force(batch, {directions(2 * 9 * 14, 27), {}, {}}, {.delta = DeltaDepth::Window}, true);
}

// A cell is passed only when it faces away, d . n > 0: one that a ray grazes exactly is hit, and so is one without a
// normal, (0, 0, 0).
TEST(Ssrt, HitsCellsThatItGrazesAndCellsWithoutANormal) {
  Scene scene = scene_of(1, 18, 23, 28);
  for (int y = 0; y < 18; ++y)
    for (int x = 0; x < 23; ++x) {
      const Vec3 n = (x + y) % 3 == 0 ? Vec3(0) : (x + y) % 3 == 1 ? Vec3(0, 0, 1) : Vec3(x % 2 ? 1 : -1, 0, 0);
      for (int c = 0; c < 3; ++c) scene.normal.at(0, c, y, x) = n[c];
    }
  const Rays rays{directions(18 * 23, 29), {}, {}};  // a third of these go along an axis or in a plane of two
  expect_brute_force(scene, rays, {}, true);
  int grazed = 0, bare = 0;
  const std::vector<int> hit = run(scene, rays, {}, true, Precision::Single)[0].integer;
  for (std::size_t i = 0; i < hit.size(); ++i) {
    if (hit[i] < 0) continue;
    const int p = static_cast<int>(i) / 16, k = static_cast<int>(i) % 16, y = hit[i] / 23, x = hit[i] % 23;
    double towards = 0, length = 0;
    for (int c = 0; c < 3; ++c) {
      const double n = scene.normal.at(0, c, y, x);
      towards += n * rays.directions.at(0, c, p, k), length += n * n;
    }
    bare += length == 0, grazed += length > 0 && towards == 0;
  }
  EXPECT_GT(bare, 100);
  EXPECT_GT(grazed, 100);
  Scene none = scene;
  none.normal = Tensor(scene.normal.shape);
  EXPECT_EQ(run(none, rays, {}, true, Precision::Single)[0].integer,
            run(none, rays, {}, false, Precision::Single)[0].integer);
}

TEST(Ssrt, EqualsBruteForceFromAnywhere) {
  const Scene scene = scene_of(1, 17, 22, 6);
  expect_brute_force(scene, rays_from_anywhere(600, 7, 17 * 22));  // more rows than the picture has pixels
}

// Rays of a block may have the shape of the picture: they are told apart by what is said, not by that.
TEST(Ssrt, EqualsBruteForceFromAnywhereInBlocksOfThePicturesShape) {
  const Scene scene = scene_of(1, 40, 16, 6);
  expect_brute_force(scene, rays_from_anywhere(40, 7, 40 * 16));
}

TEST(Ssrt, EqualsBruteForceOnPicturesOfOneRowOrColumn) {
  for (const auto& [h, w] : {std::pair{1, 40}, std::pair{40, 1}, std::pair{1, 1}, std::pair{2, 3}, std::pair{33, 2}}) {
    const Scene scene = scene_of(1, h, w, 8);
    for (const SsrtSolver solver : {SsrtSolver::Dda, SsrtSolver::Hierarchical})
      compare(scene, rays_from_anywhere(80, 9, h * w), {.solver = solver}, false, Precision::Double);
  }
}

TEST(Ssrt, EqualsBruteForceInABatchWithMapsOfOrigins) {
  Scene scene = scene_of(3, 9, 14, 10);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  Rays rays{directions(3 * 9 * 14, 12), Tensor(Shape{3, 3, 9, 14}), {}, true};
  for (double& x : rays.points.real) x = static_cast<float>(unit(random));
  for (int n = 0; n < 3; ++n)
    for (int y = 0; y < 9; ++y)
      for (int x = 0; x < 14; ++x) rays.points.at(n, 2, y, x) -= 1.5;
  for (double& x : rays.points.real) x = static_cast<float>(x);
  std::vector<int> skip;
  for (int k = 0; k < 3 * 9 * 14; ++k) skip.push_back(k % 5 ? k % (9 * 14) : -1);
  rays.skip = Tensor::of_int({3, 1, 9, 14}, skip);
  expect_brute_force(scene, rays);
}

// A picture of one depth alone has no range to count in: no hit is behind another.
TEST(Ssrt, WindowDepthOfAFlatMapIsCertain) {
  Scene scene = scene_of(1, 18, 23, 30);
  std::fill(scene.depth.real.begin(), scene.depth.real.end(), 2.0);
  for (const SsrtSolver solver : {SsrtSolver::Dda, SsrtSolver::Hierarchical}) {
    const auto got = run(scene, rays_from_anywhere(2000, 31, 18 * 23), {.solver = solver, .delta = DeltaDepth::Window},
                         false, Precision::Single);
    int hits = 0;
    for (std::size_t i = 0; i < got[0].integer.size(); ++i) {
      if (got[0].integer[i] < 0) continue;
      ++hits;
      ASSERT_EQ(got[1].real[i], 0);
      ASSERT_EQ(got[2].real[i], 0);
    }
    EXPECT_GT(hits, 100);
  }
}

TEST(Ssrt, SolversAgreeToTheLastBit) {
  // A bigger picture, so that all levels of the pyramid are used, in float.
  const Scene scene = scene_of(1, 150, 270, 13);
  for (const Rays& rays : {Rays{directions(150 * 270, 14), {}, {}}, rays_from_anywhere(3000, 15, 150 * 270)})
    for (const bool facing : {false, true})
      for (const DeltaDepth delta : {DeltaDepth::Linear, DeltaDepth::Window}) {
        const auto a = run(scene, rays, {.solver = SsrtSolver::Dda, .delta = delta}, facing, Precision::Single);
        const auto b =
            run(scene, rays, {.solver = SsrtSolver::Hierarchical, .delta = delta}, facing, Precision::Single);
        EXPECT_EQ(a[0].integer, b[0].integer);
        EXPECT_EQ(a[1].real, b[1].real);
        EXPECT_EQ(a[2].real, b[2].real);
      }
}

TEST(Ssrt, RaysSideBySideDoNotMatterToEachOther) {
  const Scene scene = scene_of(1, 60, 90, 21);
  const Rays rays{directions(60 * 90, 22), {}, {}};
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const auto one = run(scene, rays, {.lanes = 1}, true, precision);
    for (const int lanes : {4, 8, 16}) {
      const auto many = run(scene, rays, {.lanes = lanes}, true, precision);
      EXPECT_EQ(many[0].integer, one[0].integer) << lanes;
      EXPECT_EQ(many[1].real, one[1].real) << lanes;
    }
  }
  EXPECT_THROW(run(scene, rays, {.lanes = 2}, true, Precision::Single), Error);
}

// Flat walls with normals that are a little off, and normals without a direction among them: blocks pass for facing
// away, for facing, and for neither.
TEST(Ssrt, BoxesAroundNormalsChangeNoHit) {
  const BenchRoom room = bench_room(48, 36);
  Scene scene{room.camera, room.depth, room.normal};
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (double& component : scene.normal.real) component = static_cast<float>(2 * component + 0.05 * normal(random));
  const double strange[][3]{{0, 0, 0}, {NAN, 0, 1}, {INFINITY, 0, 1}, {1e-20, 0, 0}};
  for (int k = 0; k < 40; ++k)
    for (int c = 0; c < 3; ++c) scene.normal.at(0, c, (7 * k) % 36, (11 * k) % 48) = strange[k % 4][c];
  // Into the room, many of them along walls.
  Rays rays{Tensor(Shape{1, 3, 48 * 36, 16}), {}, {}};
  for (std::size_t i = 0; i < rays.directions.real.size(); ++i)
    rays.directions.real[i] = static_cast<float>(normal(random) * (i % 5 ? 1 : 0.02));
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const std::vector<Tensor> boxes = run(scene, rays, {}, true, precision),
                              cells = run(scene, rays, {.solver = SsrtSolver::Dda}, true, precision);
    EXPECT_EQ(boxes[0].integer, cells[0].integer);
    EXPECT_EQ(boxes[1].real, cells[1].real);
    EXPECT_NE(boxes[0].integer, run(scene, rays, {}, false, precision)[0].integer);
  }
}

TEST(Ssrt, IsSymmetricUnderMirrors) {
  const int h = 40, w = 52;
  Scene scene{Camera::from_fov(w, h, 70.0), landscape(1, h, w, 16), {}};
  const Rays rays{directions(h * w, 17), {}, {}};
  const std::vector<int> straight = run(scene, rays, {}, false, Precision::Single)[0].integer;
  for (const int axis : {0, 1}) {
    Scene mirrored = scene;
    Rays turned = rays;
    const auto image_of = [&](int pixel) {
      const int y = pixel / w, x = pixel % w;
      return axis == 0 ? y * w + (w - 1 - x) : (h - 1 - y) * w + x;
    };
    for (int p = 0; p < h * w; ++p) {
      const int q = image_of(p);
      mirrored.depth.at(0, 0, q / w, q % w) = scene.depth.at(0, 0, p / w, p % w);
      for (int k = 0; k < 16; ++k)
        for (int c = 0; c < 3; ++c)
          turned.directions.at(0, c, q, k) = rays.directions.at(0, c, p, k) * (c == axis ? -1 : 1);
    }
    const std::vector<int> seen = run(mirrored, turned, {}, false, Precision::Single)[0].integer;
    int differ = 0;
    for (int p = 0; p < h * w; ++p)
      for (int k = 0; k < 16; ++k) {
        if (k == 4 || k == 5) continue;  // along the axis of view: from diagonal pixels these pass through corners
        const int a = straight[static_cast<std::size_t>(p * 16 + k)],
                  b = seen[static_cast<std::size_t>(image_of(p) * 16 + k)];
        differ += (a < 0 ? -1 : image_of(a)) != b;
      }
    // Mirrored positions round differently (w - x): knife edges only. A solver that is off by a cell on one side
    // differs in a tenth of the rays.
    EXPECT_LE(differ, h * w * 14 / 2000) << "axis " << axis;
  }
}

TEST(Ssrt, DoesNotDependOnTheBatchItIsIn) {
  const Scene scene = scene_of(2, 20, 31, 18);
  const Rays rays{directions(2 * 20 * 31, 19), {}, {}};
  const auto both = run(scene, rays, {}, true, Precision::Single);
  for (int n = 0; n < 2; ++n) {
    Scene one = scene;
    Rays part{Tensor(Shape{1, 3, 20 * 31, 16}), {}, {}};
    const auto cut = [&](const Tensor& t) {
      const long item = t.shape.item();
      return Tensor({1, t.shape.c, t.shape.h, t.shape.w},
                    std::vector<double>(t.real.begin() + n * item, t.real.begin() + (n + 1) * item));
    };
    one.depth = cut(scene.depth), one.normal = cut(scene.normal);
    for (int p = 0; p < 20 * 31; ++p)
      for (int k = 0; k < 16; ++k)
        for (int c = 0; c < 3; ++c) part.directions.at(0, c, p, k) = rays.directions.at(0, c, n * 20 * 31 + p, k);
    const auto alone = run(one, part, {}, true, Precision::Single);
    const std::size_t first = static_cast<std::size_t>(n * 20 * 31 * 16), count = 20 * 31 * 16;
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(alone[0].integer[i], both[0].integer[first + i]);
      ASSERT_EQ(alone[1].real[i], both[1].real[first + i]);
    }
  }
}

// A wall at 45 degrees seen by rays that must end on a known column: the geometry by hand.
TEST(Ssrt, MeetsAWallWhereGeometrySays) {
  const int w = 64, h = 8;
  Scene scene{Camera::from_fov(w, h, 90.0), Tensor(Shape{1, 1, h, w}), {}};
  // Left half: a far wall at 4.1 m. Right half: near wall at 2 m.
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) scene.depth.at(0, 0, y, x) = x < w / 2 ? 4.1 : 2;
  Rays rays{Tensor(Shape{1, 3, 1, 16}), Tensor(Shape{1, 3, 1, 16}),
            Tensor::of_int({1, 1, 1, 16}, std::vector<int>(16, -1))};
  for (int k = 0; k < 16; ++k) {
    rays.points.at(0, 0, 0, k) = -1, rays.points.at(0, 2, 0, k) = -3;  // 3 m deep, 1 m to the left
    rays.directions.at(0, k % 2 ? 2 : 0, 0, k) = k % 2 ? -1 : 1;
  }
  const auto got = run(scene, rays, {}, false, Precision::Single);
  // To the right at depth 3: enters the near half at its first column, 1 m behind the surface; scene_scale is 4.1 m.
  EXPECT_EQ(got[0].integer[0] % w, w / 2);
  EXPECT_NEAR(got[1].at(0, 0, 0, 0), 1.0 / 4.1, 16 * kFloatRounding);  // of depths, as shares of the farthest
  // Straight ahead: 1.1 m on, x/z = -1/4.1, in front of the far wall until it is met: no gap.
  EXPECT_EQ(got[0].integer[1] % w, static_cast<int>(w / 2 - w / 2 / 4.1));
  EXPECT_EQ(got[1].at(0, 0, 0, 1), 0);
}

TEST(Ssrt, LeavesByEachOfTheFourSides) {
  const int w = 30, h = 20;
  Scene scene{Camera::from_fov(w, h, 80.0), Tensor(Shape{1, 1, h, w}, 5.0), {}};
  Rays rays{Tensor(Shape{1, 3, 1, 16}), Tensor(Shape{1, 3, 1, 16}),
            Tensor::of_int({1, 1, 1, 16}, std::vector<int>(16, -1))};
  for (int k = 0; k < 16; ++k) {
    rays.points.at(0, 2, 0, k) = -2;
    rays.directions.at(0, k / 2 % 2, 0, k) = k % 2 ? 1 : -1;
  }
  const auto got = run(scene, rays, {}, false, Precision::Single);
  for (int k = 0; k < 16; ++k) {
    EXPECT_EQ(got[0].integer[static_cast<std::size_t>(k)], -1);
    EXPECT_EQ(got[2].at(0, 0, 0, k), 1);
  }
}

TEST(Ssrt, RefusesWhatDoesNotFit) {
  Graph g;
  const SsrtScene scene = ssrt_scene(g.input("depth", {1, 1, 8, 8}));
  const Value camera = g.input("camera", {1, 4, 1, 1}), range = g.input("range", {1, 3, 1, 1});
  EXPECT_THROW(ssrt(scene, camera, range, g.input("seven", {1, 3, 64, 7})), Error);
  EXPECT_THROW(ssrt(scene, range, range, g.input("others", {1, 3, 64, 16})), Error);
  const Value rays = g.input("rays", {1, 3, 64, 16}), points = g.input("points", {1, 3, 8, 8}),
              skip = g.input("skip", {1, 1, 8, 8}, Type::Int);
  EXPECT_THROW(ssrt(scene, camera, range, rays, {points, skip}), Error) << "of pixels, and not said";
  EXPECT_THROW(ssrt(scene, camera, range, points, {rays, skip, true}), Error);
  EXPECT_THROW(ssrt_solver_of("fast"), Error);
  EXPECT_THROW(depth_range(Tensor(Shape{1, 1, 2, 2})), Error);
}

}  // namespace
}  // namespace clerestory
