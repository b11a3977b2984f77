// Rooms in InteriorVerse's layout, RGB-D frames and G-buffers: units, cleaning, missing and wrong files.
#include "host/io/datasets.hpp"

#include <cmath>
#include <limits>

#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

constexpr int width = 6, height = 4;

RoomView sample() {
  RoomView view;
  view.image = Image(width, height, 3, 0.5f), view.mask = Image(width, height, 1, 1);
  view.albedo = Image(width, height, 3, 0.25f), view.depth = Image(width, height, 1);
  view.material = Image(width, height, 3, 0.5f), view.normal = Image(width, height, 3);
  for (std::size_t i = 0; i < view.depth.data.size(); ++i) {
    view.depth.data[i] = 0.7f + 0.13f * static_cast<float>(i);
    const float angle = 0.1f * static_cast<float>(i);
    view.normal.plane(0)[i] = std::sin(angle), view.normal.plane(2)[i] = std::cos(angle);
  }
  view.emission = Image(width, height, 3);
  view.emission->at(1, 2, 3) = 40;
  view.camera = Camera::from_fov(width, height, 70);
  view.exposure = 2.5;
  return view;
}

class Datasets : public Scratch {
 protected:
  // Overwrites one map of a written view.
  void spoil(const char* what, const Image& image) const {
    write_exr(view_file(folder, "000", what), image, ExrType::Float);
  }
};

TEST_F(Datasets, ViewRoundTrip) {
  const RoomView view = sample();
  write_view(folder / "room", "003", view);
  const RoomView same = read_view(folder / "room", "003");
  EXPECT_EQ(same.image.data, view.image.data);
  EXPECT_EQ(same.albedo.data, view.albedo.data);
  EXPECT_EQ(same.material.data, view.material.data);
  EXPECT_EQ(same.mask.data, view.mask.data);
  EXPECT_EQ(same.emission->data, view.emission->data);
  EXPECT_EQ(same.camera, view.camera);
  EXPECT_EQ(same.exposure, 2.5);
  for (std::size_t i = 0; i < view.depth.data.size(); ++i) {  // times 1000, over 1000: two roundings
    EXPECT_NEAR(same.depth.data[i], view.depth.data[i], 2 * view.depth.data[i] * std::numeric_limits<float>::epsilon());
    EXPECT_NEAR(same.normal.plane(0)[i], view.normal.plane(0)[i], 4 * std::numeric_limits<float>::epsilon());
  }
  put("room/.004_im.exr", "a copy that another program began");
  EXPECT_EQ(list_views(folder / "room"), std::vector<std::string>{"003"});
  EXPECT_EQ(read_view(folder / "room/003").depth.data, same.depth.data) << "by path ROOM/NNN";
}

TEST_F(Datasets, FilesAreInteriorVerses) {
  RoomView view = sample();
  view.depth.data[5] = 0;
  write_view(folder, "000", view);
  const Image depth = read_image(folder / "000_depth.exr");
  EXPECT_EQ(depth.channels, 1);
  EXPECT_NEAR(depth.data[1], 830, 830 * std::numeric_limits<float>::epsilon()) << "millimetres";
  EXPECT_EQ(depth.data[5], HUGE_VALF) << "inf where there is none";
  const RoomView same = read_view(folder, "000");
  EXPECT_EQ(same.depth.data[5], 0);
  EXPECT_EQ(same.mask.data[5], 0);
  for (const char* name : {"im", "mask", "albedo", "depth", "material", "normal", "emission"})
    EXPECT_TRUE(std::filesystem::exists(view_file(folder, "000", name))) << name;
  EXPECT_EQ(view_file("r", "012", "camera", "json"), std::filesystem::path("r/012_camera.json"));
  EXPECT_EQ(view_id(7), "007");
  EXPECT_EQ(view_id(1234), "1234");
}

TEST_F(Datasets, Units) {
  Image depth(5, 1, 1);
  depth.data = {0, 1.5f, -1, HUGE_VALF, std::nanf("")};
  metres_to_millimetres(depth);
  EXPECT_EQ(depth.data, (std::vector<float>{HUGE_VALF, 1500, HUGE_VALF, HUGE_VALF, HUGE_VALF}));
  millimetres_to_metres(depth);
  EXPECT_EQ(depth.data, (std::vector<float>{0, 1.5f, 0, 0, 0}));
}

TEST_F(Datasets, FlawsOfTheDataAreMasked) {
  write_view(folder, "000", sample());
  Image normal = sample().normal, albedo = sample().albedo, material = sample().material, mask(width, height, 1, 1);
  normal.plane(1)[3] = std::nanf("");
  normal.plane(0)[4] = normal.plane(2)[4] = 0;
  normal.plane(0)[6] = 0, normal.plane(2)[6] = 3;
  albedo.plane(2)[7] = HUGE_VALF;
  material.plane(0)[8] = std::nanf("");
  mask.data[9] = 0;
  spoil("normal", normal), spoil("albedo", albedo), spoil("material", material), spoil("mask", mask);
  const RoomView view = read_view(folder, "000");
  for (std::size_t i = 0; i < view.mask.data.size(); ++i)
    EXPECT_EQ(view.mask.data[i], i == 3 || i == 4 || (i >= 7 && i <= 9) ? 0 : 1) << i;
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(view.normal.plane(c)[3], 0);
    EXPECT_EQ(view.albedo.plane(c)[7], 0);
    EXPECT_EQ(view.material.plane(c)[8], 0);
  }
  EXPECT_EQ(view.normal.plane(2)[6], 1) << "made unit length";
}

TEST_F(Datasets, RadianceIsChecked) {
  write_view(folder, "000", sample());
  Image image = sample().image;
  image.at(0, 1, 2) = -0.5f;
  spoil("im", image);
  EXPECT_EQ(read_view(folder, "000").image.at(0, 1, 2), 0);
  image.at(0, 1, 2) = std::nanf("");
  spoil("im", image);
  expect_error([&] { read_view(folder, "000"); }, {"000_im.exr", "pixel (2, 1)"});
}

TEST_F(Datasets, DepthInThreeChannels) {
  write_view(folder, "000", sample());
  Image depth(width, height, 3, 2000);
  spoil("depth", depth);
  EXPECT_EQ(read_view(folder, "000").depth.data, std::vector<float>(width * height, 2));
  write_exr(folder / "000_depth.exr", Image(width, height, 2), ExrType::Float, {"u", "v"});
  expect_error([&] { read_view(folder, "000"); }, {"000_depth.exr", "wrong channels"});
}

TEST_F(Datasets, PartsOfAView) {
  write_view(folder, "000", sample());
  std::filesystem::remove(folder / "000_albedo.exr");
  expect_error([&] { read_view(folder, "000"); }, {"000_albedo.exr", "No such file"});
  const RoomView view = read_view(folder, "000", {.mask = false, .albedo = false, .emission = false});
  EXPECT_EQ(view.albedo.channels, 0);
  EXPECT_FALSE(view.emission.has_value());
  EXPECT_EQ(view.mask.data, std::vector<float>(width * height, 1)) << "a mask is always there";
  expect_error([&] { read_view(folder, "000", {false, false, false, false, false, false, false}); }, {"nothing"});
  expect_error([&] { read_view(folder, "001"); }, {"001_im.exr"});
}

TEST_F(Datasets, WrongSizes) {
  write_view(folder, "000", sample());
  spoil("normal", Image(width + 1, height, 3, 1));
  expect_error([&] { read_view(folder, "000"); }, {"000_normal.exr", "7x4", "6x4"});
  write_view(folder, "000", sample());
  write_camera(folder / "000_camera.json", Camera::from_fov(12, 8, 60));
  expect_error([&] { read_view(folder, "000"); }, {"000_camera.json", "12x8", "6x4"});
  RoomView bad = sample();
  bad.albedo = Image(width, height, 1);
  expect_error([&] { write_view(folder, "001", bad); }, {"001_albedo.exr", "6x4x1", "6x4x3"}, ErrorKind::Failed);
  bad = sample();
  bad.image.at(2, 3, 1) = HUGE_VALF;
  expect_error([&] { write_view(folder, "001", bad); }, {"001_im.exr", "(1, 3)"}, ErrorKind::Failed);
  EXPECT_EQ(list_views(folder), std::vector<std::string>{"000"}) << "a view without im is not complete";
}

TEST_F(Datasets, BrightLampsAreStoredInFloat) {
  RoomView view = sample();
  view.emission->at(0, 0, 0) = 1e6f;
  write_view(folder, "000", view);
  EXPECT_EQ(read_view(folder, "000").emission->at(0, 0, 0), 1e6f);
}

TEST_F(Datasets, Rooms) {
  for (const char* room : {"b", "a", "c"}) std::filesystem::create_directories(folder / room);
  write_rooms(folder, "train", {"b", "a"});
  EXPECT_EQ(get(folder / "train.txt"), "b\na\n");
  EXPECT_EQ(list_rooms(folder, "train"), (std::vector<std::string>{"b", "a"}));
  put("val.txt", "a \r\n\n  \nc");
  EXPECT_EQ(list_rooms(folder, "val"), (std::vector<std::string>{"a", "c"}));
  put("empty.txt", "");
  EXPECT_TRUE(list_rooms(folder, "empty").empty());
  expect_error([&] { list_rooms(folder, "test"); }, {"test.txt", "no such list of rooms"});
  const auto refused = [&](const std::string& text, std::initializer_list<std::string> parts) {
    put("test.txt", text);
    expect_error([&] { list_rooms(folder, "test"); }, parts);
  };
  refused("a\nb\na\n", {"test.txt:3", "twice"});
  refused("a\nmissing\n", {"test.txt:2", "no folder", "missing"});
  refused("../a\n", {"test.txt:1", "no name"});
  refused("..\n", {"test.txt:1", "no name"});
  expect_error([&] { list_views(folder / "none"); }, {"none"});
  EXPECT_TRUE(list_views(folder / "c").empty());
}

TEST_F(Datasets, RealFrames) {
  for (const char* name : {"office", "carpet", "fr3_desk", "motorcycle"}) {
    SCOPED_TRACE(name);
    const RgbdFrame frame = read_rgbd(asset(std::string("real/") + name));
    EXPECT_EQ(frame.photo.encoding, Encoding::Gamma);
    EXPECT_EQ(frame.photo.image.channels, 3);
    EXPECT_FALSE(frame.camera.integer_centres);
    EXPECT_FALSE(frame.camera.has_pose);
    std::size_t valid = 0;
    float nearest = 1e9f, farthest = 0;
    for (float d : frame.depth.data)
      if (d > 0) ++valid, nearest = std::min(nearest, d), farthest = std::max(farthest, d);
    EXPECT_GT(static_cast<double>(valid) / static_cast<double>(frame.depth.pixels()), 0.7);
    EXPECT_GT(nearest, 0.4f);
    EXPECT_LT(farthest, 10.0f) << "metres";
    EXPECT_EQ(frame.right.has_value(), std::string(name) == "motorcycle");
  }
}

// The valid shares and ranges that the frames' README states, by this reader.
TEST_F(Datasets, OfficeAsDocumented) {
  const RgbdFrame frame = read_rgbd(asset("real/office"));
  std::size_t valid = 0;
  for (float d : frame.depth.data) valid += d > 0;
  EXPECT_NEAR(static_cast<double>(valid) / static_cast<double>(frame.depth.pixels()), 0.83, 0.005);  // in whole percent
}

TEST_F(Datasets, RgbdFoldersOfOthers) {
  const Image picture(4, 3, 3, 0.5f);
  write_png(folder / "rgb.png", picture);
  write_exr(folder / "depth.exr", Image(4, 3, 1, 2), ExrType::Float, {"Z"});
  const std::string camera = R"({"width":4,"height":3,"fx":5,"fy":5,"cx":1.5,"cy":1,"depth_kind":"axial")";
  put("camera.json", camera + "}");
  const RgbdFrame frame = read_rgbd(folder);
  EXPECT_TRUE(frame.camera.integer_centres);
  EXPECT_EQ(frame.camera.camera.cx, 2) << "half a pixel added";
  EXPECT_EQ(frame.camera.camera.cy, 1.5);

  Image depth(4, 3, 1, 2);
  for (float bad : {-1.0f, HUGE_VALF, std::nanf("")}) {
    depth.at(0, 2, 1) = bad;
    write_exr(folder / "depth.exr", depth, ExrType::Float);
    expect_error([&] { read_rgbd(folder); }, {"depth.exr", "(1, 2)"});
  }
  write_exr(folder / "depth.exr", Image(3, 4, 1, 2), ExrType::Float);
  expect_error([&] { read_rgbd(folder); }, {"depth.exr", "3x4", "4x3"});
  write_exr(folder / "depth.exr", Image(4, 3, 1, 2), ExrType::Float);
  put("camera.json", R"({"width":8,"height":6,"fx":5,"fy":5,"cx":1.5,"cy":1})");
  expect_error([&] { read_rgbd(folder); }, {"camera.json", "8x6", "4x3"});
  std::filesystem::remove(folder / "rgb.png");
  expect_error([&] { read_rgbd(folder); }, {"holds no picture", "rgb.png"});
}

TEST_F(Datasets, GBufferFolder) {
  Image normal(4, 3, 3), albedo(4, 3, 3, 0.5f), material(4, 3, 3, 0), depth(4, 3, 1, 2);
  for (std::size_t i = 0; i < normal.pixels(); ++i) normal.plane(2)[i] = 1.0004f;
  albedo.at(0, 0, 0) = 1.0005f;  // rounding of another program
  depth.at(0, 1, 1) = 0;
  write_exr(folder / "normal.exr", normal, ExrType::Float);
  write_exr(folder / "albedo.exr", albedo, ExrType::Float);
  write_exr(folder / "material.exr", material);
  write_exr(folder / "depth.exr", depth, ExrType::Float, {"distance"});
  const GBuffer maps = read_gbuffer(folder);
  EXPECT_EQ(maps.normal->at(2, 0, 0), 1);
  EXPECT_EQ(maps.albedo->at(0, 0, 0), 1);
  EXPECT_EQ(maps.depth->at(0, 1, 1), 0);
  EXPECT_FALSE(maps.camera.has_value());
  EXPECT_FALSE(maps.mask.has_value());
  write_camera(folder / "camera.json", Camera::from_fov(4, 3, 60));
  EXPECT_EQ(read_gbuffer(folder).camera.value().camera, Camera::from_fov(4, 3, 60));

  const auto refused = [&](const char* name, const Image& bad, std::initializer_list<std::string> parts) {
    const std::string before = get(folder / name);
    write_exr(folder / name, bad, ExrType::Float);
    expect_error([&] { read_gbuffer(folder); }, parts);
    put(name, before);
  };
  Image bad = albedo;
  bad.at(1, 2, 3) = 1.1f;
  refused("albedo.exr", bad, {"albedo.exr", "1.1", "pixel (3, 2)", "0 to 1"});
  bad = material;
  bad.at(0, 2, 3) = -0.1f;
  refused("material.exr", bad, {"material.exr", "-0.1"});
  bad = depth;
  bad.data[5] = -2;
  refused("depth.exr", bad, {"depth.exr", "negative", "-2"});
  bad.data[5] = HUGE_VALF;
  refused("depth.exr", bad, {"depth.exr", "not finite"});
  refused("normal.exr", Image(4, 3, 3, 0.5f), {"normal.exr", "unit"});
  refused("normal.exr", Image(4, 4, 3, 0.5f), {"4x4", "4x3"});
  refused("material.exr", Image(4, 3, 1), {"material.exr", "R, G, B"});
  write_camera(folder / "camera.json", Camera::from_fov(40, 30, 60));
  expect_error([&] { read_gbuffer(folder); }, {"camera.json", "40x30"});
  expect_error([&] { read_gbuffer(folder / "none"); }, {"none", "neither"});
  std::filesystem::create_directories(folder / "bare");
  expect_error([&] { read_gbuffer(folder / "bare"); }, {"holds no map"});
}

TEST_F(Datasets, GBufferOfAView) {
  write_view(folder / "room", "000", sample());
  EXPECT_TRUE(is_view(folder / "room/000"));
  EXPECT_FALSE(is_view(folder / "room/001"));
  EXPECT_FALSE(is_view(folder / "room"));
  const GBuffer maps = read_gbuffer(folder / "room/000");
  EXPECT_FLOAT_EQ(maps.depth->data[0], 0.7f) << "metres";
  EXPECT_EQ(maps.material->at(2, 2, 3), 1) << "the lamp";
  EXPECT_EQ(maps.material->at(2, 0, 0), 0);
  EXPECT_EQ(maps.material->at(0, 0, 0), 0.5f);
  ASSERT_TRUE(maps.camera);
  EXPECT_TRUE(maps.camera->has_pose);
  EXPECT_EQ(maps.camera->camera, *sample().camera);
  EXPECT_TRUE(maps.mask.has_value());
}

}  // namespace
}  // namespace clerestory
