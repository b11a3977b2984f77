// Judgements of IIW: what is read, what is refused by file and key, and which pictures are whose.
#include "host/io/iiw.hpp"

#include <gmock/gmock.h>

#include "host/io/image.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

using testing::ElementsAre;

const std::string kGood =
    R"({"intrinsic_points": [{"id": 7, "x": 0.25, "y": 0.5, "opaque": true, "sRGB": "ffffff"},
                             {"id": 9, "x": 0.75, "y": 1, "opaque": false}],
        "intrinsic_comparisons": [{"point1": 9, "point2": 7, "darker": "2", "darker_score": 1.5},
                                  {"point1": 7, "point2": 9, "darker": null, "darker_score": null}]})";

struct Iiw : Scratch {
  std::filesystem::path with(const std::string& right, const std::string& wrong) const {
    std::string text = kGood;
    const std::size_t at = text.find(right);
    EXPECT_NE(at, std::string::npos) << right;
    return put("5.json", text.replace(at, right.size(), wrong));
  }
  void refuses(const std::string& right, const std::string& wrong, std::initializer_list<std::string> parts) const {
    const auto path = with(right, wrong);
    expect_error([&] { read_judgements(path); }, {path.string()});
    expect_error([&] { read_judgements(path); }, parts);
  }
};

TEST_F(Iiw, PointsAndComparisonsAreRead) {
  const Judgements j = read_judgements(put("5.json", kGood));
  ASSERT_EQ(j.points.size(), 2u);
  EXPECT_EQ(j.points[1].id, 9);
  EXPECT_EQ(j.points[0].x, 0.25);
  EXPECT_EQ(j.points[1].y, 1);
  EXPECT_TRUE(j.points[0].opaque);
  EXPECT_FALSE(j.points[1].opaque);
  ASSERT_EQ(j.comparisons.size(), 2u);
  EXPECT_EQ(j.comparisons[0].first, 1u);
  EXPECT_EQ(j.comparisons[0].second, 0u);
  EXPECT_EQ(j.comparisons[0].darker, Darker::Second);
  EXPECT_EQ(j.comparisons[0].weight, 1.5);
  EXPECT_FALSE(j.comparisons[1].darker);
}

TEST_F(Iiw, WhatIsWrittenIsReadAgain) {
  Judgements j = read_judgements(put("5.json", kGood));
  j.comparisons.push_back({0, 1, Darker::Equal, 0.1});
  j.comparisons.push_back({0, 1, Darker::First, 1.0 / 3});
  write_judgements(folder / "6.json", j);
  const Judgements again = read_judgements(folder / "6.json");
  ASSERT_EQ(again.points.size(), j.points.size());
  for (std::size_t i = 0; i < j.points.size(); ++i) {
    EXPECT_EQ(again.points[i].id, j.points[i].id);
    EXPECT_EQ(again.points[i].x, j.points[i].x);
    EXPECT_EQ(again.points[i].y, j.points[i].y);
    EXPECT_EQ(again.points[i].opaque, j.points[i].opaque);
  }
  ASSERT_EQ(again.comparisons.size(), j.comparisons.size());
  for (std::size_t i = 0; i < j.comparisons.size(); ++i) {
    EXPECT_EQ(again.comparisons[i].first, j.comparisons[i].first);
    EXPECT_EQ(again.comparisons[i].second, j.comparisons[i].second);
    EXPECT_EQ(again.comparisons[i].darker, j.comparisons[i].darker);
    EXPECT_EQ(again.comparisons[i].weight, j.comparisons[i].weight);
  }
}

TEST_F(Iiw, WrongFilesAreRefusedByKey) {
  refuses("intrinsic_points", "points", {"the key intrinsic_points is missing"});
  refuses("intrinsic_comparisons", "comparisons", {"the key intrinsic_comparisons is missing"});
  refuses("\"id\": 9", "\"id\": 7", {"an id of intrinsic_points is there twice (found 7)"});
  refuses("\"x\": 0.75", "\"x\": 1.75", {"wrong value of intrinsic_points[1].x (found 1.75, expected a fraction"});
  refuses("\"x\": 0.75, ", "", {"intrinsic_points[1] lacks the key x"});
  refuses("\"opaque\": true", "\"opaque\": 1", {"wrong value of intrinsic_points[0].opaque (found 1"});
  refuses("\"point1\": 7", "\"point1\": 8",
          {"wrong value of intrinsic_comparisons[1].point1 (found 8, expected the id of one of intrinsic_points)"});
  refuses("\"darker\": \"2\"", "\"darker\": 2", {"wrong value of intrinsic_comparisons[0].darker (found 2"});
  refuses("1.5", "null", {"wrong value of intrinsic_comparisons[0].darker_score (found null"});
  const auto none = put("5.json", R"({"intrinsic_points": [], "intrinsic_comparisons": []})");
  expect_error([&] { read_judgements(none); }, {"5.json", "intrinsic_points holds no point"});
  const auto text = put("5.json", R"({"intrinsic_points": ["p"], "intrinsic_comparisons": []})");
  expect_error([&] { read_judgements(text); },
               {"wrong value of intrinsic_points[0] (found \"p\", expected an object)"});
}

TEST_F(Iiw, EveryFifthPictureInTheOrderOfTextsIsForTests) {
  for (const char* id : {"9", "10", "100", "11", "12", "13", "2"}) {
    put(std::string(id) + ".json", kGood);
    put(std::string(id) + (*id == '9' ? ".jpg" : ".png"), "picture");
  }
  put("notes.txt", "");
  const std::vector<IiwPicture> all = list_iiw(folder);
  const auto ids = [](const std::vector<IiwPicture>& pictures) {
    std::vector<std::string> names;
    for (const IiwPicture& p : pictures) names.push_back(p.id);
    return names;
  };
  EXPECT_THAT(ids(all), ElementsAre("10", "100", "11", "12", "13", "2", "9"));
  EXPECT_EQ(all[6].picture, folder / "9.jpg");
  EXPECT_THAT(ids(iiw_split(all, true)), ElementsAre("10", "2"));
  EXPECT_THAT(ids(iiw_split(all, false)), ElementsAre("100", "11", "12", "13", "9"));
}

TEST_F(Iiw, FoldersWithoutPicturesOrJudgementsAreRefused) {
  expect_error([&] { list_iiw(folder); }, {folder.string(), "holds no judgements"});
  expect_error([&] { list_iiw(folder / "none"); }, {"none", "cannot be read"});
  put("5.json", kGood);
  expect_error([&] { list_iiw(folder); }, {"5.json", "has no picture beside it", "5.png"});
}

}  // namespace
}  // namespace clerestory
