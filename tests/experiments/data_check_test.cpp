// `clerestory data check`: its figures on maps that are known, and that every kind of damage is named by its file.
#include "experiments/evaluation/data_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr double kBin = 1.0 / 1200;  // of a range: half a bin for the value, half for the numbers

TEST(Histogram, QuantilesOfKnownNumbers) {
  Histogram roughness(MapQuantity::Roughness), depth(MapQuantity::Depth);
  EXPECT_TRUE(std::isnan(roughness.quantile(0.5)));
  for (int i = 0; i < 1000; ++i) {
    roughness.add((i + 0.5) / 1000);
    depth.add(0.1 * std::pow(1000, (i + 0.5) / 1000));
  }
  for (const double q : {0.1, 0.5, 0.9}) {
    EXPECT_NEAR(roughness.quantile(q), q, kBin);
    EXPECT_NEAR(std::log(depth.quantile(q) / 0.1) / std::log(1000), q, kBin);
  }
  const Histogram::Shares shares = depth.shares(10);
  for (const double share : shares.share) EXPECT_NEAR(share, 0.1, 2 * kBin);  // either end
  EXPECT_DOUBLE_EQ(shares.at[0], 0.1 * std::pow(1000, 0.05));
  Histogram metallic(MapQuantity::Metallic);
  metallic.add(0);
  EXPECT_EQ(metallic.quantile(0.5), 0);
  depth.add(0), depth.add(1e9);  // beyond both ends
  EXPECT_EQ(depth.count(), 1002);
}

/// A wall of one material whose depth grows by a factor from column to column.
RoomView slope_view(double factor) {
  constexpr int w = 12, h = 8;
  RoomView view;
  view.image = Image(w, h, 3, 0.5f), view.mask = Image(w, h, 1, 1), view.albedo = Image(w, h, 3, 0.25f);
  view.depth = Image(w, h, 1), view.material = Image(w, h, 3, 0), view.normal = Image(w, h, 3, 0);
  for (std::size_t i = 0; i < view.mask.pixels(); ++i) {
    view.depth.data[i] = static_cast<float>(2 * std::pow(factor, static_cast<double>(i % w)));
    view.material.plane(0)[i] = 0.75f, view.material.plane(1)[i] = 1;
    view.normal.plane(0)[i] = 0.6f, view.normal.plane(2)[i] = 0.8f;
  }
  return view;
}

TEST(DataCheck, FiguresOfMapsThatAreKnown) {
  const ScratchFolder folder("clerestory-data-check");
  RoomView view = slope_view(1.1);
  for (std::size_t i = 0; i < 24; ++i) view.mask.data[i] = 0;  // the first two rows
  view.mask.at(0, 5, 6) = 0;                                   // and a hole, over which there is no step
  write_view(folder / "room", "000", view);
  write_rooms(folder.path(), "val", {"room"});
  const DataCheck check = check_data(folder.path(), 0);
  EXPECT_TRUE(check.problems.empty());
  EXPECT_EQ(check.rooms, 1);
  EXPECT_EQ(check.views, 1);
  EXPECT_EQ(check.usable, 1);
  EXPECT_EQ(check.pixels, 96u);
  EXPECT_EQ(check.valid, 71u);
  const auto median = [&](MapQuantity q) { return check.histograms[static_cast<std::size_t>(q)].quantile(0.5); };
  EXPECT_NEAR(median(MapQuantity::Albedo), 0.25, kBin);
  EXPECT_NEAR(median(MapQuantity::Roughness), 0.75, kBin);
  EXPECT_NEAR(median(MapQuantity::Metallic), 1, kBin);
  EXPECT_NEAR(median(MapQuantity::Facing), std::acos(0.8) * 180 / std::acos(-1.0), 180 * kBin);
  EXPECT_NEAR(median(MapQuantity::DepthStep), std::log(1.1), std::log(1e6) * kBin * std::log(1.1));
  EXPECT_LT(median(MapQuantity::NormalStep), 0.1);
  EXPECT_EQ(check.histograms[static_cast<std::size_t>(MapQuantity::DepthStep)].count(), 6u * 11u - 2u);
}

struct DamagedData : testing::Test {
  ScratchFolder folder{"clerestory-damaged-data"};
  fs::path data = folder / "data";
  void SetUp() override { write_synthetic_rooms(data, "train", 2, 2, 32, 24, 5); }
  std::string room(std::size_t i) const { return list_rooms(data, "train")[i]; }
  fs::path file(const char* what) const { return view_file(data / room(0), "000", what); }
  /// Of `number` problems the first; its file is as expected.
  std::string problem_of(const fs::path& expected, std::size_t number = 1) const {
    const DataCheck check = check_data(data, 0);
    EXPECT_EQ(check.problems.size(), number);
    if (check.problems.empty()) return "";
    EXPECT_EQ(check.problems[0].file, expected.string());
    return check.problems[0].what;
  }
};

TEST_F(DamagedData, WholeRoomsHaveNoProblem) {
  const DataCheck check = check_data(data, 0);
  EXPECT_TRUE(check.problems.empty());
  EXPECT_EQ(check.usable, 4);
  EXPECT_EQ(check_data(data, 3).views, 3);
  fs::remove(view_file(data / room(1), "000", "depth"));
  EXPECT_EQ(check_data(data, 2).problems.size(), 1u) << "the views of a part are not spread over the rooms";
}

TEST_F(DamagedData, MissingAndCutMapsAreNamed) {
  for (const char* what : {"depth", "im"}) {
    const std::string whole = read_file(file(what), 1 << 20);
    fs::remove(file(what));
    EXPECT_THAT(problem_of(file(what)), HasSubstr("cannot be opened"));
    std::ofstream(file(what), std::ios::binary) << whole.substr(0, whole.size() / 2);
    EXPECT_NE(problem_of(file(what)), "");
    std::ofstream(file(what), std::ios::binary) << whole;
  }
}

TEST_F(DamagedData, SizesRangesAndBlackPicturesAreNamed) {
  write_exr(file("normal"), Image(16, 12, 3, 1), ExrType::Float);
  EXPECT_THAT(problem_of(file("normal")), HasSubstr("16x12"));
  write_exr(file("normal"), Image(32, 24, 3, 1), ExrType::Float);
  EXPECT_THAT(problem_of(file("normal")),
              HasSubstr("768 of 768 pixels, valid by their mask, have a normal that is not"));
  write_exr(file("normal"), Image(32, 24, 3, std::sqrt(1.0f / 3)), ExrType::Float);
  write_exr(file("albedo"), Image(32, 24, 3, 1.5f), ExrType::Half);
  EXPECT_THAT(problem_of(file("albedo")), HasSubstr("1.5 at (0, 0)"));
  write_exr(file("albedo"), Image(32, 24, 3, 0.5f), ExrType::Half);
  write_exr(file("im"), Image(32, 24, 3, 0), ExrType::Half);
  EXPECT_THAT(problem_of(file("im")), HasSubstr("black"));
}

TEST_F(DamagedData, HolesAndDepthInMetresAreNamed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const char* what : {"albedo", "material", "normal"}) {
    const Image whole = read_map(file(what), 3);
    Image holes = whole;
    for (std::size_t i = 0; i < 5; ++i) holes.plane(1)[i] = nan;
    write_exr(file(what), holes, ExrType::Float);
    EXPECT_THAT(problem_of(file(what)), HasSubstr("5 of 768 pixels, valid by their mask"));
    write_exr(file(what), whole, ExrType::Float);
  }
  write_exr(file("depth"), Image(32, 24, 1, 2.5f), ExrType::Float);
  EXPECT_THAT(problem_of(file("depth")), HasSubstr("0.0025 m"));
  write_exr(file("depth"), Image(32, 24, 1, nan), ExrType::Float);
  EXPECT_THAT(problem_of(file("depth"), 2), HasSubstr("768 of 768 pixels, valid by their mask, have no depth"));
}

TEST_F(DamagedData, WhatTheMaskLeavesOutIsNoProblem) {
  Image mask = read_map(file("mask"), 1), depth = read_map(file("depth"), 1), normal = read_map(file("normal"), 3),
        albedo = read_map(file("albedo"), 3);
  for (std::size_t i = 0; i < 32; ++i) {
    mask.data[i] = depth.data[i] = 0;
    albedo.plane(1)[i] = std::numeric_limits<float>::quiet_NaN();
    for (int c = 0; c < 3; ++c) normal.plane(c)[i] *= 3;
  }
  write_exr(file("mask"), mask), write_exr(file("depth"), depth, ExrType::Float);
  write_exr(file("normal"), normal, ExrType::Float), write_exr(file("albedo"), albedo, ExrType::Float);
  EXPECT_TRUE(check_data(data, 0).problems.empty());
}

TEST_F(DamagedData, ListsAndRoomsAtFaultHideNoOthers) {
  const std::string rooms = room(0) + "\n" + room(1) + "\n";
  const fs::path list = data / "train.txt";
  write_file(list, "nowhere\n" + rooms);
  EXPECT_THAT(problem_of(list.string() + ":1"), HasSubstr("no folder"));
  EXPECT_EQ(check_data(data, 0).usable, 4);
  write_file(list, rooms);
  write_file(data / "test.txt", rooms.substr(0, room(0).size()) + "\n");
  EXPECT_THAT(problem_of(data / "test.txt"), HasSubstr("train.txt"));
  EXPECT_EQ(check_data(data, 0).usable, 4) << "a room of two lists counts once";
  write_file(data / "test.txt", "\n");
  EXPECT_THAT(problem_of(data / "test.txt"), HasSubstr("names no room"));
}

TEST_F(DamagedData, TheProgramGoesOnAndSaysSoInTheEnd) {
  fs::remove(file("material"));
  const fs::path json = folder / "check.json", page = folder / "check.html", log = folder / "log.txt";
  Program program({"data", "check", data.string(), data.string(), "--json=" + json.string(), "--report", page.string()},
                  log);
  EXPECT_EQ(program.wait(), 2);
  EXPECT_THAT(text_of(log), HasSubstr(file("material").string()));
  EXPECT_THAT(text_of(json), HasSubstr("\"usable\": 3"));
  EXPECT_THAT(text_of(page), HasSubstr("10th, 50th and 90th percentile"));
  Program nothing({"data", "check", folder.path().string()}, log);
  EXPECT_EQ(nothing.wait(), 2);
  EXPECT_THAT(text_of(log), HasSubstr("train.txt, val.txt or test.txt"));
  Program unwritable({"data", "check", data.string(), "--report", (folder / "nowhere/check.html").string()}, log);
  EXPECT_EQ(unwritable.wait(), 2);
  EXPECT_THAT(text_of(log), testing::AllOf(HasSubstr("nowhere"), testing::Not(HasSubstr("percentile"))));
}

}  // namespace
}  // namespace clerestory
