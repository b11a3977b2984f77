// camera.json: round trip to the bit, the RGB-D convention, wrong keys.
#include "host/io/camera_file.hpp"

#include <cmath>

#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

class CameraFiles : public Scratch {
 protected:
  static constexpr const char* plain = R"("width":640,"height":480,"fx":525.5,"fy":526,"cx":320,"cy":240)";
  CameraFile read(const std::string& json) const { return read_camera(put("camera.json", "{" + json + "}")); }
};

TEST_F(CameraFiles, RoundTripToTheBit) {
  Camera camera = Camera::from_fov(741, 500, 61.7);
  camera.cx = 1.0 / 3;
  look_at(camera, {0.1, 1.6, -2}, {2, 0.3, 0.7});
  write_camera(folder / "c.json", camera, 0.1 + 0.2);
  const CameraFile same = read_camera(folder / "c.json");
  EXPECT_EQ(same.camera, camera);
  EXPECT_TRUE(same.has_pose);
  EXPECT_EQ(same.exposure, 0.1 + 0.2);
  EXPECT_FALSE(same.integer_centres);
  write_camera(folder / "d.json", camera);
  EXPECT_EQ(read_camera(folder / "d.json").exposure, std::nullopt);
}

TEST_F(CameraFiles, PoseIsOptional) {
  const CameraFile file = read(plain);
  EXPECT_FALSE(file.has_pose);
  EXPECT_EQ(file.camera.camera_to_world, Camera().camera_to_world) << "level, at the origin";
  EXPECT_EQ(file.camera.fx, 525.5);
  EXPECT_EQ(file.camera.cx, 320);
}

TEST_F(CameraFiles, RgbdConventionIsConverted) {
  const CameraFile file = read(std::string(plain) + R"(,"depth_kind":"axial","distortion":null,"note":"x")");
  EXPECT_TRUE(file.integer_centres);
  EXPECT_EQ(file.camera.cx, 320.5);
  EXPECT_EQ(file.camera.cy, 240.5);
  EXPECT_EQ(file.distortion, std::nullopt);
  EXPECT_EQ(read(std::string(plain) + R"(,"distortion":[0,0,0,0,0])").distortion, std::nullopt);
  const auto bent = read(std::string(plain) + R"(,"distortion":[0.2,-0.7,0,0,0.9])").distortion;
  ASSERT_TRUE(bent.has_value());
  EXPECT_EQ((*bent)[4], 0.9);
  expect_error([&] { read(std::string(plain) + R"(,"depth_kind":"euclidean")"); },
               {"depth_kind", "euclidean", "axial"});
  expect_error([&] { read(std::string(plain) + R"(,"distortion":[1])"); }, {"distortion", "5 numbers"});
}

TEST_F(CameraFiles, AssetsAreInThisConvention) {
  const CameraFile office = read_camera(asset("real/office/camera.json"));
  EXPECT_FALSE(office.integer_centres);
  EXPECT_EQ(office.camera.cx, 320.5);
  EXPECT_EQ(office.camera.cy, 240.5);
  EXPECT_EQ(office.camera.fx, 525);
  const CameraFile garage = read_camera(asset("real/motorcycle/camera.json"));
  EXPECT_EQ(garage.camera.cx, 311.693);
  EXPECT_EQ(garage.camera.cy, 255.377);
  EXPECT_EQ(garage.baseline, 0.193001);
}

TEST_F(CameraFiles, WrongKeys) {
  const std::string file = "camera.json";
  for (const char* key : {"width", "height", "fx", "fy", "cx", "cy"}) {
    std::string json = plain;
    json.replace(json.find('"' + std::string(key) + '"'), std::string(key).size() + 2, "\"other\"");
    expect_error([&] { read(json); }, {file, key, "missing"});
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string json = plain;
    json.replace(json.find(from), from.size(), to);
    return [this, json] { read(json); };
  };
  expect_error(with("640", "0"), {file, "width", "0"});
  expect_error(with("640", "640.5"), {file, "width", "whole"});
  expect_error(with("640", "-640"), {file, "width", "-640"});
  expect_error(with("640", "99999999999999999999"), {file, "width"});
  expect_error(with("525.5", "0"), {file, "fx"});
  expect_error(with("525.5", "\"525\""), {file, "fx", "a number"});
  expect_error(with("525.5", "1e999"), {file});
  expect_error(with("525.5", "null"), {file, "fx"});
  expect_error([&] { read(std::string(plain) + R"(,"camera_to_world":[1,2,3])"); }, {file, "camera_to_world", "16"});
  expect_error([&] { read(std::string(plain) + R"(,"camera_to_world":[2,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1])"); },
               {file, "orthonormal"});
  expect_error([&] { read(std::string(plain) + R"(,"exposure":0)"); }, {file, "exposure"});
  expect_error([&] { read(std::string(plain) + R"(,"exposure":"a")"); }, {file, "exposure"});
  expect_error([&] { read_camera(put("list.json", "[1]")); }, {"list.json", "an object"});
  expect_error([&] { read_camera(folder / "none.json"); }, {"none.json", "No such file"});
  Camera bad = Camera::from_fov(4, 4, 60);
  bad.fx = std::nan("");
  expect_error([&] { write_camera(folder / "bad.json", bad); }, {"bad.json", "fx"});
  EXPECT_FALSE(std::filesystem::exists(folder / "bad.json"));
}

}  // namespace
}  // namespace clerestory
