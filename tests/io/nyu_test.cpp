// NYUv2's labelled file: what is written is read, and what is damaged is refused by name.
#include "host/io/nyu.hpp"

#include <hdf5/serial/hdf5.h>

#include <cmath>

#include "host/io/files.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

constexpr int width = 7, height = 5, count = 3;

Image shown(int number) {
  Image image(width, height, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<float>((i * 7 + static_cast<std::size_t>(number)) % 256) / 255;
  return image;
}
Image depth(int number) {
  Image image(width, height, 1);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = 1.25f + static_cast<float>(i) / 3 + number;
  return image;
}

struct Nyu : Scratch {
  std::filesystem::path written() const {
    const auto path = folder / kNyuFile;
    NyuWriter writer(path, count, width, height);
    for (int n = 1; n <= count; ++n) writer.put(n, shown(n), depth(n));
    writer.commit();
    return path;
  }
};

TEST_F(Nyu, PicturesAndDepthsComeBack) {
  const NyuFile file(written());
  EXPECT_EQ(file.size(), count);
  EXPECT_EQ(file.width(), width);
  EXPECT_EQ(file.height(), height);
  for (int n = 1; n <= count; ++n) {
    EXPECT_EQ(file.depth(n).data, depth(n).data);
    const Image linear = file.picture(n), stored = shown(n);
    for (std::size_t i = 0; i < stored.data.size(); ++i)
      EXPECT_NEAR(linear.data[i], std::pow(stored.data[i], 2.2), 1e-6) << i;
  }
  EXPECT_EQ(entries(), 1u) << "nothing is left beside it";
}

// The order of the sides is MATLAB's: A(y, x, c, n) is the n-th picture, and HDF5 names them the other way round.
TEST_F(Nyu, SidesStandInTheOrderOfMatlab) {
  const hid_t file = H5Fopen(written().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, "depths", H5P_DEFAULT), space = H5Dget_space(set);
  hsize_t sides[3] = {};
  ASSERT_EQ(H5Sget_simple_extent_dims(space, sides, nullptr), 3);
  EXPECT_EQ(sides[0], hsize_t{count});
  EXPECT_EQ(sides[1], hsize_t{width});
  EXPECT_EQ(sides[2], hsize_t{height});
  std::vector<float> all(count * width * height);
  ASSERT_GE(H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()), 0);
  EXPECT_EQ(all[(2 - 1) * width * height + 3 * height + 4], depth(2).at(0, 4, 3));
  H5Sclose(space), H5Dclose(set), H5Fclose(file);
  EXPECT_EQ(get(folder / kNyuFile).substr(0, 10), "MATLAB 7.3");
}

TEST_F(Nyu, TruncatedFilesAreRefusedByName) {
  const std::string bytes = get(written());
  ASSERT_GT(bytes.size(), 2000u);
  for (std::size_t length = 0; length < bytes.size(); length += length < 600 ? 61 : 97) {
    const auto path = put("short.mat", bytes.substr(0, length));
    SCOPED_TRACE(length);
    expect_error([&] { NyuFile{path}; }, {"short.mat"});
  }
  const auto path = put("short.mat", bytes.substr(0, bytes.size() - 1));
  expect_error([&] { NyuFile{path}; }, {"short.mat", "truncated", "HDF5, as MATLAB's format 7.3 is"});
  expect_error([&] { NyuFile{folder / "none.mat"}; }, {"none.mat", "cannot be opened"});
  expect_error([&] { NyuFile{folder}; }, {folder.string(), "is a folder"});
}

/// A file with one dataset of these sides.
void write_only(const std::filesystem::path& path, const char* name, std::vector<hsize_t> sides, hid_t type) {
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(sides.size()), sides.data(), nullptr);
  const hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dclose(set), H5Sclose(space), H5Fclose(file);
}

TEST_F(Nyu, WhatIsMissingOrOfAnotherSizeIsNamed) {
  const auto path = folder / "a.mat";
  write_only(path, "depths", {1, 4, 3}, H5T_IEEE_F32LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "holds no images"});
  write_only(path, "images", {1, 4, 4, 3}, H5T_STD_U8LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "holds no depths"});
  write_only(path, "images", {4, 4, 3}, H5T_STD_U8LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "wrong size of images (found 4x4x3, expected 4 sides"});
  write_only(path, "images", {1, 3, 4, 70000}, H5T_STD_U8LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "wrong size of images (found 1x3x4x70000"});
  write_only(path, "images", {1, 3, 4, 3}, H5T_IEEE_F32LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "wrong type of images"});
  write_only(path, "images", {1, 3, 4, 3}, H5T_STD_U16LE);
  expect_error([&] { NyuFile{path}; }, {"a.mat", "wrong type of images", "8 bits"});
}

TEST_F(Nyu, PicturesThatAreNotThereAndWrongDepthsAreRefused) {
  const NyuFile file(written());
  expect_error([&] { file.depth(0); }, {kNyuFile, "there is no such picture (found 0, expected 1 to 3)"});
  expect_error([&] { file.picture(4); }, {kNyuFile, "found 4"});
  Image wrong = depth(1);
  wrong.at(0, 2, 3) = -1;
  NyuWriter writer(folder / "b.mat", 1, width, height);
  writer.put(1, shown(1), wrong);
  writer.commit();
  expect_error([&] { NyuFile(folder / "b.mat").depth(1); },
               {"b.mat", "a depth of picture 1 is wrong", "-1 at channel 0, pixel (3, 2)"});
}

TEST_F(Nyu, NothingIsWrittenWithoutCommit) {
  { NyuWriter(folder / "c.mat", 1, width, height).put(1, shown(1), depth(1)); }
  EXPECT_EQ(entries(), 0u);
  EXPECT_THROW(NyuWriter(folder / "c.mat", 1, width, height).put(1, shown(1), Image(width, height + 1, 1)), Error);
}

TEST_F(Nyu, NormalsAreDecodedAndMasked) {
  NyuNormals normals{Image(2, 1, 3), Image(2, 1, 1)};
  normals.normal.data = {0.6f, 0, 0, -1, 0.8f, 0};  // (0.6, 0, 0.8), (0, -1, 0)
  normals.mask.data = {1, 0};
  write_nyu_normals(folder, 12, normals);
  ASSERT_TRUE(std::filesystem::exists(folder / "normals/0012.png"));
  const NyuNormals read = read_nyu_normals(folder, 12);
  EXPECT_EQ(read.mask.data, normals.mask.data);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(read.normal.data[i], normals.normal.data[i], 1.5 / 255) << i;
  double squares = 0;
  for (int c = 0; c < 3; ++c) squares += std::pow(read.normal.plane(c)[0], 2.0);
  EXPECT_NEAR(squares, 1, 1e-6) << "unit length";
  write_png(folder / "masks/0012.png", Image(2, 2, 1, 1.0f));
  expect_error([&] { read_nyu_normals(folder, 12); }, {"masks/0012.png", "another size than the normals"});
  expect_error([&] { read_nyu_normals(folder, 13); }, {"normals/0013.png"});
}

}  // namespace
}  // namespace clerestory
