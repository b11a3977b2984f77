// Protocols of others over small data sets whose figures are known.
#include "experiments/evaluation/benchmark.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/evaluation/whdr.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nyu.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::Pair;

const fs::path kSource = CLERESTORY_SOURCE_DIR;

/// What an error says.
template <class Call>
std::string said_by(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    return error.what();
  }
  return "nothing";
}

double figure(const BenchmarkResult& result, const std::string& key) {
  for (std::size_t m = 0; m < result.metrics.size(); ++m)
    if (result.metrics[m].key == key && result.figures[m].size() == 1) return result.figures[m][0];
  ADD_FAILURE() << key << " has no figure, or several";
  return -1;
}

BenchmarkResult judged(const Benchmark& benchmark, const PredictedMaps& maps) {
  return run_benchmark(benchmark, [&](std::size_t) { return maps; });
}

struct Benchmarks : testing::Test {
  ScratchFolder folder{"clerestory-benchmarks"};

  /// The example of IIW's format as a data set of one picture.
  fs::path example() const {
    fs::create_directories(folder / "iiw");
    fs::copy(kSource / "assets/real/office/rgb.png", folder / "iiw/office.png");
    fs::copy(fs::path(CLERESTORY_TEST_DATA) / "iiw/judgements.json", folder / "iiw/office.json");
    return folder / "iiw";
  }

  fs::path room() const {
    write_synthetic_rooms(folder / "rooms", "test", 1, 1, 32, 24, 3);
    return folder / "rooms/test_room_0/000";
  }
  static PredictedMaps truth(const fs::path& view) {
    const RoomView read = read_view(view);
    return {read.albedo, read.normal, read.depth, read.material};
  }

  /// Two pictures of 32x24 with depths on both sides of 10 m and with normals.
  fs::path nyu() const {
    const fs::path set = folder / "nyu";
    fs::create_directories(set);
    NyuWriter writer(set / kNyuFile, 2, 32, 24);
    for (int n = 1; n <= 2; ++n) {
      Image depth(32, 24, 1);
      for (std::size_t i = 0; i < depth.data.size(); ++i) depth.data[i] = 0.5f + 0.015f * static_cast<float>(i * n);
      writer.put(n, Image(32, 24, 3, 0.5f), depth);
      NyuNormals normals{Image(32, 24, 3), Image(32, 24, 1, 1.0f)};
      std::fill_n(normals.normal.plane(2), normals.normal.pixels(), 1.0f);
      write_nyu_normals(set, n, normals);
    }
    writer.commit();
    return set;
  }
};

TEST_F(Benchmarks, TheExampleOfIiwHasItsExpectedRate) {
  const nlohmann::json expected = read_json_object(fs::path(CLERESTORY_TEST_DATA) / "iiw/expected.json");
  const fs::path data = example();
  EXPECT_EQ(layout_of(data), DataLayout::Iiw);
  const Benchmark benchmark = iiw_benchmark(Protocol::Zhu, data, {});
  ASSERT_EQ(benchmark.names, std::vector<std::string>{"office"});
  const BenchmarkResult result = judged(benchmark, {.albedo = benchmark.picture(0)});
  const double linear = expected["whdr_linear_image_as_reflectance"];
  EXPECT_NEAR(figure(result, "whdr_linear_percent"), 100 * linear, 5e-5);
  EXPECT_NE(figure(result, "whdr_display_percent"), figure(result, "whdr_linear_percent"));
  EXPECT_THAT(result.facts, Contains(Pair("pairs", "11 count, 2 passed over")));
  // printf 'office\n' | sha256sum
  EXPECT_THAT(result.facts, Contains(Pair("sha256 of their list",
                                          "9d36b4e7dafb80a1cb6a72377fb1fe22a05ef2d4d5476ae23d1e137ee52f57b9")));
}

TEST_F(Benchmarks, IiwIsSplitAndListed) {
  const fs::path data = example();
  for (const char* id : {"a", "b", "c", "d", "e"}) {
    fs::copy(data / "office.png", data / (std::string(id) + ".png"));
    fs::copy(data / "office.json", data / (std::string(id) + ".json"));
  }
  const auto names = [&](const BenchmarkList& list) { return iiw_benchmark(Protocol::Li, data, list).names; };
  EXPECT_EQ(names({}), (std::vector<std::string>{"a", "office"}));
  EXPECT_EQ(names({{}, "train"}).size(), 4u);
  EXPECT_EQ(names({{}, "all"}).size(), 6u);
  write_file(folder / "list.txt", "office.png\nb\n\n");
  EXPECT_EQ(names({folder / "list.txt", ""}), (std::vector<std::string>{"office", "b"}));
  EXPECT_THAT(said_by([&] { names({{}, "val"}); }), HasSubstr("no such split of IIW (found val"));
  write_file(folder / "list.txt", "b\nq.png\n");
  EXPECT_THAT(said_by([&] {
                names({folder / "list.txt", ""});
              }),
              HasSubstr("list.txt:2: the data set has no such picture (found q.png)"));
  write_file(folder / "list.txt", "b\nb.png\n");
  EXPECT_THAT(said_by([&] { names({folder / "list.txt", ""}); }), HasSubstr("list.txt:2: the picture is listed twice"));
  write_file(folder / "list.txt", "\n");
  EXPECT_THAT(said_by([&] { names({folder / "list.txt", ""}); }), HasSubstr("lists no picture"));
  EXPECT_THAT(said_by([&] { iiw_benchmark(Protocol::Marigold, data, {}); }), HasSubstr("nothing to say of IIW"));
}

TEST_F(Benchmarks, TrueMapsOfNyuHaveNoErrorAndAScaleIsFree) {
  const fs::path data = nyu();
  EXPECT_EQ(layout_of(data), DataLayout::Nyu);
  EXPECT_EQ(layout_of(data / kNyuFile), DataLayout::Nyu);
  write_file(folder / "list.txt", "0002.png\n");
  for (const Protocol protocol : {Protocol::Zhu, Protocol::Li}) {
    const Benchmark benchmark = nyu_benchmark(protocol, data, {folder / "list.txt", ""});
    ASSERT_EQ(benchmark.names, std::vector<std::string>{"0002"});
    PredictedMaps maps;
    maps.depth = NyuFile(data / kNyuFile).depth(2), maps.normal = read_nyu_normals(data, 2).normal;
    for (float& d : maps.depth->data) d *= 0.25f;
    const BenchmarkResult result = judged(benchmark, maps);
    EXPECT_NEAR(figure(result, "depth_si_log_rooted"), 0, 1e-6);
    EXPECT_NEAR(figure(result, "normal_mean_degrees"), 0, 0.05) << "an arc cosine of a float";
    for (float& d : maps.depth->data) d = d * d;
    const BenchmarkResult worse = judged(benchmark, maps);
    EXPECT_GT(figure(worse, "depth_si_log"), 0.01);
    EXPECT_NEAR(std::pow(figure(worse, "depth_si_log_rooted"), 2), figure(worse, "depth_si_log"), 1e-12);
  }
}

TEST_F(Benchmarks, ProtocolsDifferInTheLengthOfNormals) {
  const fs::path data = nyu();
  write_file(folder / "list.txt", "1\n");
  PredictedMaps maps;
  maps.normal = Image(2, 1, 3);  // unit vectors 120 degrees apart, between which resizing makes short ones
  maps.normal->data = {0.8660254f, -0.8660254f, 0, 0, 0.5f, 0.5f};
  const auto mean_of = [&](Protocol protocol) {
    return figure(judged(nyu_benchmark(protocol, data, {folder / "list.txt", ""}), maps), "normal_mean_degrees");
  };
  EXPECT_NEAR(mean_of(Protocol::Li), 60, 1e-3) << "z stays 0.5";
  EXPECT_LT(mean_of(Protocol::Zhu), 55);
}

TEST_F(Benchmarks, TheSplitOfNyuTakesAListAndNormalsMayBeMissing) {
  const fs::path data = nyu();
  EXPECT_THAT(said_by([&] { nyu_benchmark(Protocol::Zhu, data, {{}, "test"}); }), HasSubstr("--list FILE"));
  EXPECT_EQ(nyu_benchmark(Protocol::Zhu, data, {}).names.size(), 2u);
  write_file(folder / "list.txt", "3\n");
  EXPECT_THAT(said_by([&] {
                nyu_benchmark(Protocol::Zhu, data, {folder / "list.txt", ""});
              }),
              HasSubstr("no such picture (found 3)"));
  fs::remove_all(data / "normals");
  const Benchmark benchmark = nyu_benchmark(Protocol::Zhu, data, {});
  EXPECT_THAT(benchmark.conventions, Contains(HasSubstr("normals are not judged")));
  const BenchmarkResult result = judged(benchmark, {.normal = Image(4, 3, 3, 1.0f), .depth = Image(4, 3, 1, 1.0f)});
  EXPECT_EQ(result.figures[0].size(), 0u);
  EXPECT_EQ(result.figures[2].size(), 2u);
}

TEST_F(Benchmarks, TrueMapsOfRoomsHaveNoError) {
  const fs::path view = room();
  write_file(folder / "rooms/generate.json", "{}");  // as generated rooms have it
  EXPECT_EQ(layout_of(folder / "rooms"), DataLayout::Rooms);
  for (const Protocol protocol : {Protocol::Zhu, Protocol::Li}) {
    const BenchmarkResult result = judged(rooms_benchmark(protocol, {view}), truth(view));
    for (std::size_t m = 0; m < result.metrics.size(); ++m) {
      ASSERT_EQ(result.figures[m].size(), 1u) << result.metrics[m].key;
      EXPECT_NEAR(result.figures[m][0], 0, 1e-9) << result.metrics[m].key;
    }
  }
  const BenchmarkResult marigold = judged(rooms_benchmark(Protocol::Marigold, {view}), truth(view));
  EXPECT_TRUE(std::isinf(figure(marigold, "albedo_psnr_db")));
  EXPECT_THAT(table_text(benchmark_table(marigold)), HasSubstr("infinite"));
  EXPECT_EQ(nlohmann::json::parse(benchmark_json(marigold))["metrics"]["albedo_psnr_db"]["infinite"], 1);
  EXPECT_NEAR(figure(marigold, "albedo_ssim"), 1, 1e-12);
  EXPECT_EQ(marigold.names, std::vector<std::string>{"test_room_0/000"});
}

TEST_F(Benchmarks, ErrorsOfRoomsAreThoseOfTheConventions) {
  const fs::path view = room();
  PredictedMaps maps = truth(view);
  for (float& v : maps.albedo->data) v *= 0.5f;
  for (float& v : maps.material->data) v += 0.1f;
  for (float& v : maps.depth->data) v *= 3;
  const BenchmarkResult li = judged(rooms_benchmark(Protocol::Li, {view}), maps),
                        zhu = judged(rooms_benchmark(Protocol::Zhu, {view}), maps);
  EXPECT_NEAR(figure(li, "albedo_scaled_mse"), 0, 1e-9) << "one scale is free";
  EXPECT_GT(figure(zhu, "albedo_mse"), 0.01) << "and here none";
  EXPECT_NEAR(figure(li, "roughness_mse"), 0.04, 1e-6) << "of 2 r - 1";
  EXPECT_NEAR(figure(zhu, "roughness_mse"), 0.01, 1e-6);
  EXPECT_NEAR(figure(zhu, "metallic_mse"), 0.01, 1e-6);
  EXPECT_NEAR(figure(li, "depth_log_mse"), 0, 1e-9);
  EXPECT_NEAR(figure(zhu, "depth_log_mse"), 0, 1e-9);

  maps = truth(view);
  for (float& v : maps.depth->data) v *= v;
  EXPECT_LT(figure(judged(rooms_benchmark(Protocol::Zhu, {view}), maps), "depth_log_mse"),
            0.8 * figure(judged(rooms_benchmark(Protocol::Li, {view}), maps), "depth_log_mse"))
      << "of depths up to 1, and of metres";

  maps = truth(view);
  for (int c = 0; c < 3; ++c) maps.albedo->at(c, 0, 31) = 1 - maps.albedo->at(c, 0, 31);  // emits
  EXPECT_NEAR(figure(judged(rooms_benchmark(Protocol::Li, {view}), maps), "albedo_scaled_mse"), 0, 1e-9);
  EXPECT_GT(figure(judged(rooms_benchmark(Protocol::Zhu, {view}), maps), "albedo_mse"), 1e-5);

  maps = truth(view);  // a tenth brighter as a display shows it
  Image shown = display_coded(*maps.albedo);
  for (std::size_t i = 0; i < shown.data.size(); ++i)
    maps.albedo->data[i] = static_cast<float>(std::pow(shown.data[i] - 0.1, 2.2));
  EXPECT_NEAR(figure(judged(rooms_benchmark(Protocol::Marigold, {view}), maps), "albedo_psnr_db"), 20, 1e-3);
}

TEST_F(Benchmarks, WhatWasNotPredictedHasNoFigure) {
  const fs::path view = room();
  PredictedMaps maps = truth(view);
  maps.normal.reset(), maps.material.reset();
  const BenchmarkResult result = judged(rooms_benchmark(Protocol::Zhu, {view}), maps);
  for (std::size_t m = 0; m < result.metrics.size(); ++m)
    EXPECT_EQ(result.figures[m].size(), m == 0 || m == 4 ? 1u : 0u) << result.metrics[m].key;
  const nlohmann::json json = nlohmann::json::parse(benchmark_json(result));
  EXPECT_FALSE(json["metrics"]["normal_mse"].contains("mean"));
  EXPECT_NEAR(json["metrics"]["albedo_mse"]["mean"].get<double>(), 0, 1e-9);
  EXPECT_EQ(json["facts"]["protocol"], "zhu");
}

struct PredictedMapsTest : Benchmarks {
  fs::path maps = folder / "maps";
  std::string refused(const std::string& name) const {
    return said_by([&] { read_predicted(maps, name, AlbedoCode::Linear); });
  }
};

TEST_F(PredictedMapsTest, AreFoundInFoldersOrBesideEachOther) {
  fs::create_directories(maps / "room/000");
  Image albedo(3, 2, 3, 0.5f), normal(3, 2, 3);
  std::fill_n(normal.plane(1), 6, -1.0f);
  write_exr(maps / "room/000/albedo.exr", albedo);
  write_exr(maps / "room/001_normal.exr", normal);
  write_png(maps / "5_albedo.png", albedo, Encoding::Linear);
  EXPECT_EQ(read_predicted(maps, "room/000", AlbedoCode::Linear).albedo->data, albedo.data);
  EXPECT_NEAR(read_predicted(maps, "room/000", AlbedoCode::Srgb).albedo->data[0], std::pow(0.5, 2.2), 1e-6);
  EXPECT_EQ(read_predicted(maps, "room/001", AlbedoCode::Linear).normal->data, normal.data);
  EXPECT_FALSE(read_predicted(maps, "room/001", AlbedoCode::Linear).albedo);
  Image depth(3, 1, 1);
  depth.data = {2000, INFINITY, 4000};  // millimetres, as rooms have them
  write_exr(maps / "room/002_depth.exr", depth, ExrType::Float);
  EXPECT_EQ(read_predicted(maps, "room/002", AlbedoCode::Linear).depth->data, (std::vector<float>{0.5f, 0, 1}));
  EXPECT_NEAR(read_predicted(maps, "5", AlbedoCode::Srgb).albedo->data[0], std::pow(128 / 255.0, 2.2), 1e-6);
}

TEST_F(PredictedMapsTest, AreRefusedByFile) {
  fs::create_directories(maps);
  EXPECT_THAT(refused("7"), HasSubstr("maps: holds no map of 7 (expected 7/albedo.exr"));
  write_exr(maps / "7_normal.exr", Image(3, 2, 3, 0.5f));  // length 0.87, as of a map in [0, 1]
  EXPECT_THAT(refused("7"), HasSubstr("7_normal.exr: the normals are not unit vectors (found 6 of 6"));
  fs::remove(maps / "7_normal.exr");
  Image albedo(3, 2, 3, 0.5f);
  albedo.at(1, 1, 2) = NAN;
  write_exr(maps / "7_albedo.exr", albedo);
  EXPECT_THAT(refused("7"), HasSubstr("7_albedo.exr: a value is not finite (found nan at channel 1, pixel (2, 1))"));
}

TEST_F(PredictedMapsTest, OfUnlikeKindsAreRefused) {
  const PredictedMaps one{.albedo = Image(1, 1, 3)}, other{.albedo = Image(1, 1, 3), .depth = Image(1, 1, 1)};
  check_same_kinds(one, one, "a");
  EXPECT_THAT(said_by([&] { check_same_kinds(one, other, "b"); }), HasSubstr("b: not the same kinds of maps"));
}

}  // namespace
}  // namespace clerestory
