// Files of light: what is written comes back, and what is wrong is refused by name.
#include "host/io/light_files.hpp"

#include <cmath>
#include <limits>

#include "host/io/datasets.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

constexpr int width = 8, height = 1;  // 40 x 5 tiles

/// Numbers that half precision holds.
Envmaps sample_envmaps() {
  Envmaps envmaps;
  envmaps.layout = EnvmapLayout::of(width, height);
  envmaps.radiance = Image(envmaps.layout.file_width(), envmaps.layout.file_height(), 3);
  for (std::size_t i = 0; i < envmaps.radiance.data.size(); ++i)
    envmaps.radiance.data[i] = static_cast<float>(i % 1999) / 8;
  return envmaps;
}

std::vector<Probe> sample_probes() {
  std::vector<Probe> probes(2);
  for (std::size_t k = 0; k < probes.size(); ++k) {
    probes[k].center = {0.1 + static_cast<double>(k), -0.3, -1.7};
    probes[k].distance = 0.15 + 0.1 * static_cast<double>(k), probes[k].visible = k == 0;
    probes[k].radiance = Image(probe_width, probe_height, 3, 0.5f);
    probes[k].radiance.at(1, 3, 2) = k == 0 ? 40 : 1e5f;  // the second does not fit into half
  }
  return probes;
}

class LightFiles : public Scratch {
 protected:
  void spoil(const char* what, const Image& image) const {
    write_exr(view_file(folder, "004", what), image, ExrType::Float);
  }
  void refused_probes(const std::string& list, std::initializer_list<std::string> parts) const {
    put("004_probes.json", list);
    expect_error([&] { read_probes(folder, "004"); }, parts);
  }
};

TEST_F(LightFiles, RoundTrip) {
  const Envmaps envmaps = sample_envmaps();
  write_envmaps(folder, "004", envmaps);
  const Envmaps same = read_envmaps(folder, "004", width, height);
  EXPECT_EQ(same.radiance.data, envmaps.radiance.data);
  EXPECT_EQ(same.layout.columns, 40);
  EXPECT_EQ(same.layout.rows, 5);
  // Tile (c, r) at (16c, 8r), azimuth to the right, elevation down.
  EXPECT_EQ(same.at(3, 2, 5, 6)[1], envmaps.radiance.at(1, 2 * 8 + 6, 3 * 16 + 5));

  const std::vector<Probe> probes = sample_probes();
  write_probes(folder, "004", probes);
  const std::vector<Probe> again = read_probes(folder, "004");
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(again[k].center, probes[k].center);
    EXPECT_EQ(again[k].distance, probes[k].distance);
    EXPECT_EQ(again[k].visible, probes[k].visible);
    EXPECT_EQ(again[k].radiance.data, probes[k].radiance.data);
  }
  write_probes(folder, "005", {});
  EXPECT_TRUE(read_probes(folder, "005").empty());
}

TEST_F(LightFiles, BadEnvironmentMaps) {
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"004_envmap.exr"});
  write_envmaps(folder, "004", sample_envmaps());
  expect_error([&] { read_envmaps(folder, "004", height, width); }, {"004_envmap.exr", "640x40", "80x320"});
  Image bad = sample_envmaps().radiance;
  bad.at(2, 7, 30) = std::nanf("");
  spoil("envmap", bad);
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"004_envmap.exr", "channel 2, pixel (30, 7)"});
  bad.at(2, 7, 30) = HUGE_VALF;
  spoil("envmap", bad);
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"inf", "channel 2, pixel (30, 7)"});
  bad.at(2, 7, 30) = -0.25f;
  spoil("envmap", bad);
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"-0.25", "channel 2, pixel (30, 7)"});
  spoil("envmap", Image(640, 40, 1));
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"004_envmap.exr"});
  put("004_envmap.exr", "no picture");
  expect_error([&] { read_envmaps(folder, "004", width, height); }, {"004_envmap.exr"});
}

TEST_F(LightFiles, BadProbes) {
  expect_error([&] { read_probes(folder, "004"); }, {"004_probes.json"});
  write_probes(folder, "004", sample_probes());
  const std::string good = get(folder / "004_probes.json");
  refused_probes("[", {"004_probes.json", "JSON"});
  refused_probes("{}", {"004_probes.json", "a list"});
  refused_probes("[7]", {"004_probes.json[0]", "an object"});
  refused_probes(R"([{"distance":1,"visible":true}])", {"004_probes.json[0]", "center", "nothing"});
  refused_probes(R"([{"center":[1,2],"distance":1,"visible":true}])", {"[0]", "center", "3 numbers"});
  refused_probes(R"([{"center":[1,2,"3"],"distance":1,"visible":true}])", {"[0]", "center"});
  refused_probes(R"([{"center":[1,2,1e999],"distance":1,"visible":true}])", {"004_probes.json"});
  refused_probes(R"([{"center":[1,2,3],"distance":0,"visible":true}])", {"[0]", "distance", "above 0"});
  refused_probes(R"([{"center":[1,2,3],"distance":1,"visible":1}])", {"[0]", "visible", "true or false"});
  std::string many = "[0";
  for (int i = 0; i < 100; ++i) many += ",0";
  refused_probes(many + "]", {"004_probes.json", "at most 100"});

  put("004_probes.json", good);
  spoil("probe_01", Image(64, 32, 3));
  expect_error([&] { read_probes(folder, "004"); }, {"004_probe_01.exr", "64x32", "128x64"});
  Image bad(probe_width, probe_height, 3);
  bad.at(0, 63, 127) = std::nanf("");
  spoil("probe_01", bad);
  expect_error([&] { read_probes(folder, "004"); }, {"004_probe_01.exr", "channel 0, pixel (127, 63)"});
  std::filesystem::remove(folder / "004_probe_01.exr");
  expect_error([&] { read_probes(folder, "004"); }, {"004_probe_01.exr"});
}

TEST_F(LightFiles, NothingWrongIsWritten) {
  Envmaps envmaps = sample_envmaps();
  envmaps.radiance.data[5] = -1;
  expect_error([&] { write_envmaps(folder, "004", envmaps); }, {"004_envmap.exr"}, ErrorKind::Failed);
  envmaps.radiance = Image(16, 8, 3);
  expect_error([&] { write_envmaps(folder, "004", envmaps); }, {"16x8", "640x40"}, ErrorKind::Failed);
  std::vector<Probe> probes = sample_probes();
  probes[0].radiance.data[0] = std::nanf("");
  expect_error([&] { write_probes(folder, "004", probes); }, {"004_probe_00.exr"}, ErrorKind::Failed);
  expect_error([&] { write_probes(folder, "004", std::vector<Probe>(101)); }, {"101"}, ErrorKind::Failed);
  EXPECT_EQ(entries(), 0u);
}

}  // namespace
}  // namespace clerestory
