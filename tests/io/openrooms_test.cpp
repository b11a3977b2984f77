// OpenRooms: what is written is read, what other kinds share is found there, and wrong sizes are named.
#include "host/io/openrooms.hpp"

#include <cmath>

#include "host/io/files.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

constexpr int width = 16, height = 12;

OpenRoomsView some_view() {
  OpenRoomsView view;
  view.image = Image(width, height, 3), view.albedo = Image(width, height, 3, 0.25f);
  view.normal = Image(width, height, 3), view.roughness = Image(width, height, 1, 0.6f);
  view.depth = Image(width, height, 1), view.mask = Image(width, height, 1, 1.0f);
  view.light = Image(width / 4 * 32, height / 4 * 16, 3);
  for (std::size_t i = 0; i < view.image.data.size(); ++i)
    view.image.data[i] = 0.01f + 3.7f * static_cast<float>(i % 19);
  for (std::size_t i = 0; i < view.light->data.size(); ++i) view.light->data[i] = static_cast<float>(i % 23) / 7;
  std::fill_n(view.normal.plane(0), view.normal.pixels(), 0.6f);
  std::fill_n(view.normal.plane(2), view.normal.pixels(), 0.8f);
  for (std::size_t i = 0; i < view.depth.data.size(); ++i) view.depth.data[i] = 1.3f + static_cast<float>(i);
  view.mask.at(0, 0, 1) = 0, view.mask.at(0, 0, 2) = 0.5f;
  return view;
}

struct OpenRooms : Scratch {
  OpenRoomsName name(const std::string& kind = "main_xml", int number = 1) const {
    return {folder, kind, "scene0001_00", number};
  }
  std::filesystem::path file(const std::string& what, const std::string& kind = "main_xml") const {
    return folder / kind / "scene0001_00" / what;
  }
};

/// RGBE has eight bits of the largest channel, cut off.
void expect_close(const Image& read, const Image& written) {
  ASSERT_EQ(read.data.size(), written.data.size());
  for (std::size_t i = 0; i < read.pixels(); ++i) {
    float most = 0;
    for (int c = 0; c < 3; ++c) most = std::max(most, written.plane(c)[i]);
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(read.plane(c)[i], written.plane(c)[i], most / 128) << i;
  }
}

TEST_F(OpenRooms, WhatIsWrittenIsRead) {
  const OpenRoomsView view = some_view();
  write_openrooms(name(), view);
  const OpenRoomsView read = read_openrooms(name());
  expect_close(read.image, view.image);
  ASSERT_TRUE(read.light);
  expect_close(*read.light, *view.light);
  EXPECT_EQ(read.depth.data, view.depth.data);
  EXPECT_EQ(read.mask.data, view.mask.data);
  EXPECT_NEAR(read.albedo.data[0], 0.25f, 0.01);
  EXPECT_NEAR(read.roughness.data[0], 0.6f, 0.5 / 255 + 1e-6);
  EXPECT_NEAR(read.normal.at(0, 1, 1), 0.6f, 1.0 / 255);
  EXPECT_NEAR(read.normal.at(2, 1, 1), 0.8f, 1.0 / 255);
}

TEST_F(OpenRooms, TilesOfAWrongSizeAreNamed) {
  OpenRoomsView view = some_view();
  view.light = Image(width / 4 * 16, height / 4 * 8, 3);
  write_openrooms(name(), view);
  expect_error([&] { read_openrooms(name()); },
               {"imenv_1.hdr", "tiles of a wrong size (found 64x24, expected 128x48: tiles of 32x16"});
  view.light = Image(width / 4 * 16, height / 4 * 16, 3);
  write_openrooms(name(), view);
  expect_error([&] { read_openrooms(name()); }, {"imenv_1.hdr", "(found 64x48, expected 128x48"});
  std::filesystem::remove(file("imenv_1.hdr"));
  EXPECT_FALSE(read_openrooms(name()).light);
}

TEST_F(OpenRooms, FilesOfOtherSizesAreNamed) {
  write_openrooms(name(), some_view());
  const std::string depth = get(file("imdepth_1.dat"));
  put("main_xml/scene0001_00/imdepth_1.dat", depth.substr(0, depth.size() - 1));
  expect_error([&] { read_openrooms(name()); },
               {"imdepth_1.dat", "the size it states is not its own (found 16x12 in 775 bytes"});
  put("main_xml/scene0001_00/imdepth_1.dat", std::string(8, '\xff') + "abcd");
  expect_error([&] { read_openrooms(name()); }, {"imdepth_1.dat", "(found -1x-1 in 12 bytes"});
  put("main_xml/scene0001_00/imdepth_1.dat", "abc");
  expect_error([&] { read_openrooms(name()); }, {"imdepth_1.dat", "ends too early"});
  write_png(file("imnormal_1.png"), Image(width, height + 1, 3, 0.5f));
  expect_error([&] { read_openrooms(name()); }, {"imnormal_1.png", "another size than the picture (found 16x13"});
  std::filesystem::remove(file("imnormal_1.png"));
  expect_error([&] { read_openrooms(name()); }, {"imnormal_1.png"});
}

TEST_F(OpenRooms, KindsShareWhatDoesNotDiffer) {
  OpenRoomsView view = some_view();
  write_openrooms(name("main_xml1"), view);
  view.albedo = Image(width, height, 3, 0.5f);
  for (const char* kind : {"mainDiffLight_xml1", "mainDiffMat_xml1"}) write_openrooms(name(kind), view);
  std::filesystem::remove(file("imnormal_1.png", "mainDiffLight_xml1"));
  std::filesystem::remove(file("imdepth_1.dat", "mainDiffLight_xml1"));
  std::filesystem::remove(file("imdepth_1.dat", "mainDiffMat_xml1"));
  std::filesystem::remove(file("immask_1.png", "mainDiffMat_xml1"));
  for (const char* kind : {"mainDiffLight_xml1", "mainDiffMat_xml1"}) {
    const OpenRoomsView read = read_openrooms(name(kind));
    EXPECT_EQ(read.depth.data, view.depth.data);
    EXPECT_EQ(read.mask.data, view.mask.data);
    EXPECT_NEAR(read.normal.at(0, 1, 1), 0.6f, 1.0 / 255);
    EXPECT_NEAR(read.albedo.data[0], 0.5f, 0.02);
  }
}

TEST_F(OpenRooms, ViewsAreListedByKindSceneAndNumber) {
  for (const int number : {10, 2}) write_openrooms(name("main_xml", number), some_view());
  write_openrooms(name("mainDiffMat_xml", 1), some_view());
  for (const char* other : {"im_x.hdr", "im_3x.hdr", "im_4.png", "im_0.hdr"})
    put(std::string("main_xml/scene0001_00/") + other, "");
  put("test.txt", "scene0001_00\nscene0002_00\n");
  EXPECT_TRUE(is_openrooms(folder));
  EXPECT_FALSE(is_openrooms(folder / "main_xml"));
  std::vector<std::string> texts;
  for (const OpenRoomsName& one : list_openrooms(folder, "test")) texts.push_back(one.text());
  EXPECT_EQ(texts, (std::vector<std::string>{"mainDiffMat_xml/scene0001_00/1", "main_xml/scene0001_00/2",
                                             "main_xml/scene0001_00/10"}));
  expect_error([&] { list_openrooms(folder, "train"); }, {"train.txt"});
  put("test.txt", "scene0009_00\n");
  expect_error([&] { list_openrooms(folder, "test"); }, {"there is no view", "test.txt"});
  put("test.txt", "../x\n");
  expect_error([&] { list_openrooms(folder, "test"); }, {"test.txt", "is no name of a scene"});
}

}  // namespace
}  // namespace clerestory
