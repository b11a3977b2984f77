// safetensors: exact round trips, a file spelled out byte by byte, and every rule a header can break.
#include "host/io/safetensors.hpp"

#include <bit>
#include <cmath>

#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

class Safetensors : public Scratch {
 protected:
  std::filesystem::path file_of(const std::string& header, const std::string& data) const {
    std::string bytes;
    for (int i = 0; i < 8; ++i) bytes += static_cast<char>(header.size() >> 8 * i);
    return put("f.safetensors", bytes + header + data);
  }
  void expect_refused(const std::string& header, const std::string& data,
                      std::initializer_list<std::string> parts) const {
    SCOPED_TRACE(header);
    expect_error([&] { read_safetensors(file_of(header, data)); }, parts);
  }
};

TensorFile sample() {
  TensorFile file;
  file.tensors["w"] = {{2, 1, 3}, std::vector<float>{1, -2.5f, 3e-8f, 1e30f, 0, -0.0f}};
  file.tensors["bias"] = {{3}, std::vector<float>{0.1f, 0.2f, 0.3f}};
  file.tensors["steps"] = {{}, std::vector<std::uint64_t>{0xffffffffffffffffu}};
  file.tensors["table"] = {{2, 2}, std::vector<std::int32_t>{1, -2, 2147483647, -2147483647 - 1}};
  file.tensors["none"] = {{0, 4}, std::vector<float>{}};
  file.metadata = {{"preset", "compact"}, {"note", "\"quoted\" \xc3\xbc"}};
  return file;
}

TEST_F(Safetensors, RoundTrip) {
  write_safetensors(folder / "a.safetensors", sample());
  const TensorFile same = read_safetensors(folder / "a.safetensors"), expected = sample();
  EXPECT_EQ(same.metadata, expected.metadata);
  ASSERT_EQ(same.tensors.size(), expected.tensors.size());
  for (const auto& [name, tensor] : expected.tensors) {
    EXPECT_EQ(same.get(name, "a").shape, tensor.shape) << name;
    EXPECT_EQ(same.get(name, "a").values, tensor.values) << name;
  }
  EXPECT_TRUE(std::signbit(same.get("w", "a").floats()[5])) << "-0 stays -0";
  EXPECT_EQ(entries(), 1u);
  write_safetensors(folder / "b.safetensors", same);
  EXPECT_EQ(get(folder / "a.safetensors"), get(folder / "b.safetensors"));
}

TEST_F(Safetensors, HalfStorage) {
  TensorFile file;
  // 1 + 2^-11 is a tie between 1 and 1 + 2^-10: even wins. 2^-25 is a tie between 0 and the least subnormal.
  file.tensors["w"] = {{6}, std::vector<float>{1, 1 + 0x1p-11f, 1 + 3 * 0x1p-11f, 0x1p-24f, 0x1p-25f, 65504}};
  file.tensors["n"] = {{1}, std::vector<std::uint64_t>{1ull << 60}};
  write_safetensors(folder / "h.safetensors", file, FloatStorage::F16);
  const TensorFile same = read_safetensors(folder / "h.safetensors");
  EXPECT_EQ(same.get("w", "h").floats(), (std::vector<float>{1, 1, 1 + 0x1p-9f, 0x1p-24f, 0, 65504}));
  EXPECT_EQ(same.get("n", "h").words()[0], 1ull << 60) << "integers are not touched";
  EXPECT_NE(get(folder / "h.safetensors").find("\"F16\""), std::string::npos);

  file.tensors["w"] = {{2}, std::vector<float>{0, 1e6f}};
  expect_error([&] { write_safetensors(folder / "h.safetensors", file, FloatStorage::F16); },
               {"tensor w", "1000000 at 1", "65504"}, ErrorKind::Failed);
  EXPECT_EQ(read_safetensors(folder / "h.safetensors").get("w", "h").count(), 6u) << "the old file is still there";
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Safetensors, LayoutByteByByte) {
  TensorFile file;
  file.tensors["x"] = {{2}, std::vector<float>{1, -2}};
  write_safetensors(folder / "a.safetensors", file);
  // FNV-1a of the eight bytes, then of the header without its own checksum, both by another program.
  std::string header =
      R"({"__metadata__":{"header_checksum":"79d07b95aeb203d2","tensor_checksums":"{\"x\":\"0979e9ee2da22858\"}"},)"
      R"("x":{"data_offsets":[0,8],"dtype":"F32","shape":[2]}})";
  header.resize((header.size() + 7) / 8 * 8, ' ');
  std::string expected(1, static_cast<char>(header.size()));
  expected += std::string(7, '\0') + header + std::string("\0\0\x80\x3f\0\0\0\xc0", 8);
  EXPECT_EQ(get(folder / "a.safetensors"), expected);
}

bool same(const TensorFile& a, const TensorFile& b) {
  if (a.metadata != b.metadata || a.tensors.size() != b.tensors.size()) return false;
  for (const auto& [name, tensor] : a.tensors) {
    const auto other = b.tensors.find(name);
    if (other == b.tensors.end() || other->second.shape != tensor.shape || other->second.values != tensor.values)
      return false;
  }
  return true;
}

// Header, metadata, tensors: a byte that is not the one written is found wherever it lies, or it meant nothing (a blank
// of the padding that became another one).
TEST_F(Safetensors, OneFlippedByteAnywhereIsFound) {
  write_safetensors(folder / "a.safetensors", sample());
  const std::string whole = get(folder / "a.safetensors");
  const int flips[] = {1, 2, 4, 8, 16, 32, 64, 128, 255, 'F' ^ 'I', '1' ^ '2'};
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ flips[at % std::size(flips)]);
    try {
      EXPECT_TRUE(same(read_safetensors(put("d.safetensors", damaged)), sample()))
          << "byte " << at << " of " << whole.size() << " was flipped and passed for another content";
    } catch (const Error& error) {
      ++refused;
      EXPECT_EQ(error.kind(), ErrorKind::Usage);
      EXPECT_NE(std::string(error.what()).find("d.safetensors"), std::string::npos) << error.what();
    }
  }
  EXPECT_GE(refused, whole.size() - 7) << "all but the padding";
}

TEST_F(Safetensors, DamageIsNamedByWhereItLies) {
  write_safetensors(folder / "a.safetensors", sample());
  const std::string whole = get(folder / "a.safetensors");
  const auto refused = [&](std::string from, const std::string& to, std::initializer_list<std::string> parts) {
    SCOPED_TRACE(to);
    std::string damaged = whole;
    ASSERT_NE(damaged.find(from), std::string::npos) << from;
    damaged.replace(damaged.find(from), from.size(), to);
    expect_error([&] { read_safetensors(put("d.safetensors", damaged)); }, parts);
  };
  refused("compact", "Compact", {"d.safetensors", "header", "damaged"});
  refused(R"("dtype":"F32","shape":[3])", R"("dtype":"I32","shape":[3])", {"d.safetensors", "header", "damaged"});
  const float value = 0.2f, other = 0.25f;
  const auto bytes = [](const float& v) { return std::string(reinterpret_cast<const char*>(&v), 4); };
  refused(bytes(value), bytes(other), {"d.safetensors", "tensor bias", "damaged"});
}

TEST_F(Safetensors, TellsWhetherItHasChecksums) {
  write_safetensors(folder / "a.safetensors", sample());
  EXPECT_TRUE(read_safetensors(folder / "a.safetensors").checksummed);
  const auto bare = file_of(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", std::string(4, '\0'));
  EXPECT_FALSE(read_safetensors(bare).checksummed) << "other programs keep none";
}

TEST_F(Safetensors, ReadsOtherTypes) {
  const std::string header =
      R"({"__metadata__":{"format":"pt"},"bf":{"dtype":"BF16","shape":[2],"data_offsets":[0,4]},)"
      R"("h":{"dtype":"F16","shape":[2],"data_offsets":[4,8]},"l":{"dtype":"I64","shape":[],"data_offsets":[8,16]},)"
      R"("d":{"dtype":"F64","shape":[1],"data_offsets":[16,24]}}   )";
  std::string data("\x80\x3f\x20\xc0", 4);         // bfloat16 1, -2.5
  data += std::string("\x00\x3c\x00\xfc", 4);      // half 1, -inf
  data += std::string("\x05\0\0\0\0\0\0\0", 8);    // 5
  data += std::string("\0\0\0\0\0\0\xe0\x3f", 8);  // 0.5
  const TensorFile file = read_safetensors(file_of(header, data));
  EXPECT_EQ(file.metadata.at("format"), "pt");
  EXPECT_EQ(file.get("bf", "f").floats(), (std::vector<float>{1, -2.5f}));
  EXPECT_EQ(file.get("h", "f").floats(), (std::vector<float>{1, -HUGE_VALF}));
  EXPECT_EQ(file.get("l", "f").words(), std::vector<std::uint64_t>{5});
  EXPECT_TRUE(file.get("l", "f").shape.empty());
  EXPECT_EQ(file.get("d", "f").floats(), std::vector<float>{0.5f});
}

TEST_F(Safetensors, ATensorWithoutElementsMayHaveLongSides) {
  for (const char* shape : {"[1000,0]", "[0,1000]"}) {
    const std::string header = R"({"e":{"dtype":"F32","shape":)" + std::string(shape) +
                               R"(,"data_offsets":[0,0]},"x":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})";
    EXPECT_TRUE(read_safetensors(file_of(header, std::string(8, '\0'))).get("e", "f").floats().empty()) << shape;
  }
}

TEST_F(Safetensors, EveryRuleOfTheHeader) {
  const std::string eight(8, '\0'), at = "f.safetensors";
  expect_refused("[]", "", {at, "an object"});
  expect_refused("{", "", {at, "JSON"});
  expect_refused(R"({"x":3})", "", {"tensor x", "dtype, shape and data_offsets"});
  expect_refused(R"({"x":{"dtype":"F8","shape":[2],"data_offsets":[0,8]}})", eight,
                 {"tensor x", "unknown dtype", "F8"});
  expect_refused(R"({"x":{"dtype":7,"shape":[2],"data_offsets":[0,8]}})", eight, {"tensor x", "unknown dtype"});
  expect_refused(R"({"x":{"dtype":"F32","shape":2,"data_offsets":[0,8]}})", eight, {"tensor x", "shape"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[-2],"data_offsets":[0,8]}})", eight, {"tensor x", "shape", "-2"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[1.5],"data_offsets":[0,8]}})", eight, {"tensor x", "shape"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[3],"data_offsets":[0,8]}})", eight,
                 {"tensor x", "disagree", "12 bytes"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[0]}})", eight, {"tensor x", "two numbers"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[8,0]}})", eight, {"tensor x", "outside"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[4],"data_offsets":[0,16]}})", eight, {"tensor x", "outside"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,8]}})", eight,
                 {"tensor x", "larger than the file"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[4611686018427387904,4],"data_offsets":[0,8]}})", eight, {"tensor x"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})", eight,
                 {"tensor x", "belong to no tensor"});
  expect_refused(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", eight, {at, "after the last tensor"});
  expect_refused(
      R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},"y":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})",
      eight, {"tensor y", "overlap"});
  expect_refused(R"({"__metadata__":{"a":1}})", "", {at, "metadata"});
  expect_refused(R"({"__metadata__":"a"})", "", {at, "metadata"});
  expect_refused(R"({"x":{"dtype":"I64","shape":[1],"data_offsets":[0,8]}})", std::string(8, '\xff'),
                 {"tensor x", "negative"});
}

TEST_F(Safetensors, ValuesThatAreNotFiniteAreRefusedWhereAsked) {
  TensorFile file = sample();
  write_safetensors(folder / "a.safetensors", file);
  EXPECT_TRUE(same(read_finite_safetensors(folder / "a.safetensors"), file));
  for (const float value : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
    std::get<0>(file.tensors["w"].values)[4] = value;
    for (const FloatStorage storage : {FloatStorage::F32, FloatStorage::F16}) {
      std::get<0>(file.tensors["w"].values)[3] = 0;  // 1e30 does not fit into half
      write_safetensors(folder / "a.safetensors", file, storage);
      EXPECT_NO_THROW(read_safetensors(folder / "a.safetensors"));
      expect_error([&] { read_finite_safetensors(folder / "a.safetensors"); },
                   {"a.safetensors: tensor w", "not finite", "at 4"});
    }
  }
}

TEST_F(Safetensors, TypesAndNames) {
  const TensorFile file = sample();
  expect_error([&] { file.get("w", "f").words("f: w"); }, {"f: w", "floats", "64-bit words"});
  expect_error([&] { file.get("steps", "f").floats("f: steps"); }, {"64-bit words"});
  expect_error([&] { file.get("table", "f").words(); }, {"32-bit integers"});
  expect_error([&] { file.get("bais", "f.safetensors"); }, {"f.safetensors", "bais is missing", "bias"});
  expect_error([&] { TensorFile().get("w", "f"); }, {"no tensors"});
}

TEST_F(Safetensors, RefusesToWriteNonsense) {
  TensorFile file;
  file.tensors["w"] = {{3}, std::vector<float>{1, 2}};
  expect_error([&] { write_safetensors(folder / "a", file); }, {"tensor w", "2 values", "3"}, ErrorKind::Failed);
  file.tensors.clear();
  file.tensors["__metadata__"] = {{1}, std::vector<float>{1}};
  expect_error([&] { write_safetensors(folder / "a", file); }, {"__metadata__"}, ErrorKind::Failed);
  file.tensors.clear();
  file.metadata["bad"] = "\xff";
  expect_error([&] { write_safetensors(folder / "a", file); }, {"UTF-8"}, ErrorKind::Failed);
  EXPECT_EQ(entries(), 0u);
}

}  // namespace
}  // namespace clerestory
