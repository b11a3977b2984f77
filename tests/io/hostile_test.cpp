// Files that lie, end early or are damaged: always an Error that names the file, never a crash, a hang, a huge
// allocation or a picture out of thin air. The corpus is made here, so that every byte of it can be explained.
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstring>
#include <random>

#include "host/io/camera_file.hpp"
#include "host/io/config.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/io/json_file.hpp"
#include "host/io/light_files.hpp"
#include "host/io/mesh_file.hpp"
#include "host/io/safetensors.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

class Hostile : public Scratch {
 protected:
  using Reader = std::function<void(const std::filesystem::path&)>;

  // Every shorter file must be refused, by name.
  void expect_truncations_refused(const std::string& bytes, const std::string& name, const Reader& reader,
                                  std::size_t step = 1) const {
    for (std::size_t length = 0; length < bytes.size(); length += step) {
      const auto path = put(name, bytes.substr(0, length));
      SCOPED_TRACE(std::to_string(length) + " of " + std::to_string(bytes.size()) + " bytes");
      expect_error([&] { reader(path); }, {name});
    }
  }

  // A damaged file may still be readable; what it must not do is fail in another way. Returns how many were refused.
  int damage(const std::string& bytes, const std::string& name, const Reader& reader, int times) const {
    std::mt19937 random(4);
    int refused = 0;
    for (int t = 0; t < times; ++t) {
      std::string bad = bytes;
      for (int k = 0; k < 1 + t % 3; ++k) bad[random() % bad.size()] = static_cast<char>(random());
      const auto path = put(name, bad);
      try {
        reader(path);
      } catch (const Error& error) {
        ++refused;
        EXPECT_EQ(error.kind(), ErrorKind::Usage) << error.what();
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
    return refused;
  }

  static void image(const std::filesystem::path& path) { read_image(path); }
  static void mesh(const std::filesystem::path& path) { read_mesh(path); }
  static void tensors(const std::filesystem::path& path) { read_safetensors(path); }
  static void camera(const std::filesystem::path& path) { read_camera(path); }
  static void config(const std::filesystem::path& path) {
    Schema schema;
    schema.integer("a", 1, "A number.");
    load_config(path, schema);
  }

  static Image small_picture() {
    Image picture(9, 7, 3);
    for (std::size_t i = 0; i < picture.data.size(); ++i) picture.data[i] = static_cast<float>(i % 17) / 17;
    return picture;
  }
  std::string exr() const {
    write_exr(folder / "good.exr", small_picture());
    return get(folder / "good.exr");
  }
  static std::string png() { return encode_png(small_picture(), Encoding::Gamma, "png"); }
};

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = ~0u;
  for (unsigned char c : bytes) {
    crc ^= c;
    for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (0xEDB88320u & (0u - (crc & 1)));
  }
  return ~crc;
}

std::string big_endian(std::uint32_t v) {
  return {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8), static_cast<char>(v)};
}

std::string little_endian(std::uint64_t v, int bytes) {
  std::string out;
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(v >> 8 * i);
  return out;
}

long peak_memory() {  // kilobytes
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// A PNG whose header claims another size, with the right checksum.
std::string png_of_size(std::string png, std::uint32_t width, std::uint32_t height) {
  png.replace(16, 8, big_endian(width) + big_endian(height));
  return png.replace(29, 4, big_endian(crc32(png.substr(12, 17))));
}

std::string exr_of_size(std::string exr, std::int32_t right, std::int32_t bottom) {
  const std::size_t at = exr.find("dataWindow") + std::strlen("dataWindow") + 1 + std::strlen("box2i") + 1 + 4;
  return exr.replace(
      at + 8, 8,
      little_endian(static_cast<std::uint32_t>(right), 4) + little_endian(static_cast<std::uint32_t>(bottom), 4));
}

TEST_F(Hostile, NoPicture) {
  expect_error([&] { image(put("text.png", "hello, this is no picture at all")); }, {"text.png", "PNG, JPEG"});
  expect_error([&] { image(put("empty.png", "")); }, {"empty.png", "empty"});
  expect_error([&] { image(folder); }, {"is a folder"});
  expect_error([&] { image(folder / "missing.exr"); }, {"missing.exr", "No such file"});
  expect_error([&] { read_photo(folder / "missing.exr"); }, {"missing.exr"});
  // Known by content: a wrong ending does not matter.
  put("really_png.exr", png());
  EXPECT_EQ(read_image(folder / "really_png.exr").width, 9);
}

TEST_F(Hostile, TruncatedPictures) {
  // A PNG ends with 12 bytes that only say so; without them the picture is whole.
  expect_truncations_refused(png().substr(0, png().size() - 12), "t.png", image);
  expect_truncations_refused(exr(), "t.exr", image);
  expect_truncations_refused(read_file(asset("hdri/studio.exr")), "dwab.exr", image, 9973);
  std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n";
  for (int i = 0; i < 16; ++i) hdr += "\x80\x40\x20\x81";
  put("whole.hdr", hdr);
  EXPECT_EQ(read_image(folder / "whole.hdr").width, 4);
  expect_truncations_refused(hdr, "t.hdr", image);
}

// A JPEG decoder paints grey over what is missing and calls it a warning.
TEST_F(Hostile, TruncatedJpeg) {
  const std::string jpeg = read_file(std::filesystem::path(CLERESTORY_TEST_DATA) / "io/ramp.jpg");
  put("whole.jpg", jpeg);
  EXPECT_EQ(read_image(folder / "whole.jpg").width, 32);
  expect_truncations_refused(jpeg.substr(0, jpeg.size() - 2), "t.jpg", image);
  expect_truncations_refused(jpeg, "t.jpg", image, jpeg.size() - 2);
}

TEST_F(Hostile, AbsurdSizesTakeNoMemory) {
  const std::string small_png = png(), small_exr = exr();
  const long before = peak_memory();
  for (auto [w, h] : {std::pair{0x7fffffffu, 0x7fffffffu}, {0x7fffffffu, 1u}, {20000u, 20000u}, {5000u, 5000u}}) {
    SCOPED_TRACE(std::to_string(w) + "x" + std::to_string(h));
    expect_error([&] { image(put("big.png", png_of_size(small_png, w, h))); }, {"big.png"});
  }
  for (auto [r, b] : {std::pair{0x7ffffffe, 0x7ffffffe}, {0x3fffffff, 0x3fffffff}, {20000, 20000}, {4000, 4000}}) {
    SCOPED_TRACE(std::to_string(r) + "x" + std::to_string(b));
    expect_error([&] { image(put("big.exr", exr_of_size(small_exr, r, b))); }, {"big.exr"});
  }
  for (const char* size : {"-Y 2147483647 +X 2147483647", "-Y 30000 +X 30000", "-Y 4000 +X 4000"})
    expect_error(
        [&] { image(put("big.hdr", std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n") + size + "\nxxxx")); },
        {"big.hdr"});
  // The largest size a JPEG header can claim, in a file of a few hundred bytes.
  std::string jpeg = read_file(std::filesystem::path(CLERESTORY_TEST_DATA) / "io/ramp.jpg");
  const std::size_t frame = jpeg.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  jpeg.replace(frame + 5, 4, "\xff\xff\xff\xff");
  expect_error([&] { image(put("big.jpg", jpeg)); }, {"big.jpg"});
  EXPECT_LT(peak_memory() - before, 64 * 1024) << "kilobytes; the smallest of these claims 192 MB as floats";
}

TEST_F(Hostile, ZeroSizedPictures) {
  expect_error([&] { image(put("zero.png", png_of_size(png(), 0, 0))); }, {"zero.png"});
  expect_error([&] { image(put("zero.exr", exr_of_size(exr(), -1, -1))); }, {"zero.exr"});
  expect_error([&] { image(put("zero.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n")); }, {"zero.hdr"});
}

TEST_F(Hostile, DamagedPictures) {
  EXPECT_GT(damage(png(), "d.png", image, 400), 200) << "checksums";
  EXPECT_GT(damage(exr(), "d.exr", image, 400), 50);
  damage(read_file(std::filesystem::path(CLERESTORY_TEST_DATA) / "io/ramp.jpg"), "d.jpg", image, 400);
  damage(read_file(asset("hdri/studio.exr")), "dwab.exr", image, 20);
}

TEST_F(Hostile, TruncatedAndDamagedMeshes) {
  const std::string glb = read_file(asset("models/bunny.glb"));
  expect_truncations_refused(glb, "t.glb", mesh, 397);
  // Damage to the JSON part (the first 1.2 kB) reaches every index of the format.
  const std::size_t json_end = 20 + static_cast<unsigned char>(glb[12]) + 256u * static_cast<unsigned char>(glb[13]);
  std::mt19937 random(5);
  int refused = 0;
  for (int t = 0; t < 300; ++t) {
    std::string bad = glb;
    const std::size_t at = 20 + random() % (json_end - 20);
    bad[at] = "0123456789-,:[]{}\"ex"[random() % 20];
    try {
      read_mesh(put("d.glb", bad));
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(error.kind(), ErrorKind::Usage) << error.what();
    }
  }
  EXPECT_GT(refused, 100);
  damage(glb, "d.glb", mesh, 60);
}

TEST_F(Hostile, TruncatedAndDamagedTensors) {
  TensorFile file;
  file.tensors["a.weight"] = {{2, 3}, std::vector<float>{1, 2, 3, 4, 5, 6}};
  file.tensors["b"] = {{}, std::vector<std::uint64_t>{7}};
  file.metadata["step"] = "12";
  write_safetensors(folder / "w.safetensors", file);
  const std::string bytes = get(folder / "w.safetensors");
  expect_truncations_refused(bytes, "t.safetensors", tensors);
  EXPECT_GT(damage(bytes, "d.safetensors", tensors, 1000), 200);
  expect_error([&] { tensors(folder); }, {"is a folder"});
  expect_error([&] { tensors(put("x.safetensors", little_endian(0xffffffffffffffffu, 8) + "{}")); },
               {"x.safetensors", "header of 18446744073709551615 bytes"});
}

TEST_F(Hostile, DamagedCameras) {
  write_camera(folder / "c.json", Camera::from_fov(640, 480, 60));
  const std::string bytes = get(folder / "c.json");
  expect_truncations_refused(bytes.substr(0, bytes.size() - 1), "t.json", camera);
  EXPECT_GT(damage(bytes, "d.json", camera, 500), 100);
  expect_error([&] { camera(put("deep.json", std::string(100000, '['))); }, {"deep.json"});
}

std::string repeated(const std::string& part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

// Libraries go down such a file by calling themselves: without a bound the stack ends before the file does.
constexpr int very_deep = 50'000;

TEST_F(Hostile, TomlNestedFiftyThousandDeepIsRefused) {
  for (const auto& [name, text] :
       {std::pair<std::string, std::string>{"arrays", "a = " + repeated("[", very_deep) + repeated("]", very_deep)},
        {"open arrays", "a = " + repeated("[", very_deep)},
        {"tables", "a = " + repeated("{b = ", very_deep) + "1" + repeated("}", very_deep)},
        {"dots", repeated("a.", very_deep) + "b = 1"},
        {"quoted", repeated("\"a\" . ", very_deep) + "b = 1"},
        {"header", "[" + repeated("a.", very_deep) + "b]\nc = 1"},
        {"array header", "[[" + repeated("a.", very_deep) + "b]]\nc = 1"},
        {"dots in tables", "a = " + repeated("{" + repeated("b.", 200) + "c = ", 250) + "1" + repeated("}", 250)}}) {
    SCOPED_TRACE(name);
    expect_error([&] { config(put("deep.toml", text)); }, {"deep.toml", "nested too deep"});
    expect_error([&] { parse_config(text, "stored config", Schema()); }, {"stored config", "nested too deep"});
  }
}

TEST_F(Hostile, PointsAndBracketsInTextsAreNoDepth) {
  Schema schema;
  schema.text("a", "", "A text.").texts("b", {}, "Texts.").reals("c", {}, "Numbers.");
  const std::string text = "# " + repeated("[.", 500) + "\na = \"" + repeated("\\\"[.{", 500) + "\"\nb = ['" +
                           repeated("[.", 500) + "', \"\"\"\n" + repeated("[.\"", 500) + "x\"\"\", '''" +
                           repeated("{.'", 500) + "x''']\nc = [" + repeated("0.5, ", 500) + "1.5]\n";
  const Config config = load_config(put("flat.toml", text), schema);
  EXPECT_EQ(config.text("a").size(), 2000u);
  EXPECT_EQ(config.texts("b").size(), 3u);
  EXPECT_EQ(config.reals("c").size(), 501u);
}

TEST_F(Hostile, LettersBeyondAsciiStandInQuotesAndComments) {
  Schema schema;
  schema.text("a", "", "A text.").real("b.*", 0, "A number of any name.");
  for (const char* text : {"# \n\u00e9 = 1", "# \n[\u00c2]\n", "a = \"\u00e9\"\nb.c = \u00bd", "\na = \"x\" \u0400",
                           "\na = \"\"\"\\\u0423\"\"\"", "\na = \"\\\u00e9\"", "\na = 0x\"b\"on\u014c\""})
    expect_error([&] { load_config(put("letters.toml", text), schema); }, {"letters.toml:2", "not valid TOML"});
  const char* text = "\uFEFF# \u00e9\na = '\\\u00e9' # \\\u00c2\n[b]\n'\u00e9' = 1\n";
  EXPECT_EQ(load_config(put("quoted.toml", text), schema).text("a"), "\\\u00e9");
}

TEST_F(Hostile, JsonNestedFiftyThousandDeepIsRefused) {
  const std::string deep = repeated("[", very_deep) + repeated("]", very_deep),
                    objects = repeated("{\"a\":", very_deep) + "1" + repeated("}", very_deep);
  for (const std::string& text :
       {deep, objects, "{\"width\":" + deep + "}", "{\"width\": \"\\\"\", \"fx\":" + objects + "}"})
    expect_error([&] { camera(put("deep.json", text)); }, {"deep.json", "nested too deep"});
  expect_error([&] { mesh(put("deep.gltf", "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + deep + "}")); },
               {"deep.gltf", "nested too deep"});
  const std::string header = "{\"__metadata__\":{\"a\":" + deep + "}}";
  expect_error([&] { tensors(put("deep.safetensors", little_endian(header.size(), 8) + header)); },
               {"deep.safetensors", "nested too deep"});
  expect_error([&] { read_probes(put("room/000_probes.json", deep).parent_path(), "000"); },
               {"000_probes.json", "nested too deep"});
  // Brackets inside texts are no depth.
  EXPECT_TRUE(parse_json_object("{\"a\": \"" + repeated("[\\\"{", 500) + "\"}", "flat").contains("a"));
}

TEST_F(Hostile, NothingIsReadFromAPipe) {
  for (const auto& [name, reader] : {std::pair<std::string, Reader>{"p.png", image},
                                     {"p.gltf", mesh},
                                     {"p.safetensors", tensors},
                                     {"p.json", camera},
                                     {"p.toml", config}}) {
    const auto path = folder / name;
    ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
    expect_error([&] { reader(path); }, {name, "is not a regular file"});
  }
  expect_error([] { image("/dev/zero"); }, {"/dev/zero", "is not a regular file"});
}

}  // namespace
}  // namespace clerestory
