// Opening, memory, launches, errors and profile of a device.
#include "host/cl/device.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numeric>

#include "host/cl/kernel_variant.hpp"
#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

const char* test_kernels = R"(
kernel void index2(global int *out, const int width, const int height) {
  const int x = (int)get_global_id(0), y = (int)get_global_id(1);
  if (x < width && y < height) out[y * width + x] = 1000 * y + x;
}
kernel void sizes(global uint *out) {
  if (get_global_id(0) + get_global_id(1) + get_global_id(2) > 0) return;
  for (int d = 0; d < 3; ++d) out[d] = get_global_size(d), out[3 + d] = get_local_size(d);
}
kernel void arguments(global float *out, const int i, const float f, const uint u, const ulong l, const float4 v,
                      local float *scratch) {
  scratch[0] = f;
  barrier(CLK_LOCAL_MEM_FENCE);
  out[0] = i, out[1] = scratch[0], out[2] = u, out[3] = (float)(l >> 32);
  out[4] = v.x, out[5] = v.y, out[6] = v.z, out[7] = v.w;
}
#ifndef ADD
#define ADD 1
#endif
kernel void add(global int *x) { x[get_global_id(0)] += ADD; }
#ifdef TWICE
kernel void only_twice(global int *x) { x[0] *= 2; }
#endif
)";

class DeviceTest : public testing::Test {
 protected:
  DeviceTest() : device(Device::open()), kernels("CLERESTORY_KERNELS", folder.string()) {
    folder.write("test.cl", test_kernels);
  }
  template <class T>
  std::vector<T> read(const Buffer& buffer, std::size_t count) {
    std::vector<T> values(count);
    device.read(buffer, values.data(), count * sizeof(T));
    return values;
  }

  Device device;
  ScopedFolder folder;
  ScopedVariable kernels;
};

ErrorKind kind_of(auto work) {
  try {
    work();
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "no error";
  return ErrorKind::Failed;
}

TEST_F(DeviceTest, OpensByIndexNameAndVariable) {
  ScopedVariable own("CLERESTORY_KERNELS", "");  // opening needs the probe
  const DeviceInfo info = device.info();
  EXPECT_EQ(Device::open(std::to_string(info.index)).info().name, info.name);
  EXPECT_EQ(Device::open(info.name.substr(1, 5)).info().name, info.name);
  ScopedVariable variable("CLERESTORY_DEVICE", "no such thing");
  EXPECT_EQ(Device::open(info.name).info().name, info.name);  // the argument goes before the variable
  const std::string message = message_of<Error>([] { Device::open(); });
  EXPECT_THAT(message, HasSubstr("CLERESTORY_DEVICE: no such OpenCL device"));
  EXPECT_THAT(message, HasSubstr(info.name));
}

TEST_F(DeviceTest, ASelectorThatMatchesNothingListsTheDevices) {
  EXPECT_EQ(kind_of([] { Device::open("999"); }), ErrorKind::Device);
  const std::string message = message_of<Error>([] { Device::open("abacus"); });
  EXPECT_THAT(message, HasSubstr("--device: no such OpenCL device (found abacus"));
  EXPECT_THAT(message, HasSubstr("0: "));
}

TEST_F(DeviceTest, FingerprintNamesDeviceDriverAndPlatform) {
  ScopedVariable own("CLERESTORY_KERNELS", "");  // opening needs the probe
  for (const std::string& part :
       {device.info().name, device.info().driver, device.info().platform, device.info().version})
    EXPECT_THAT(device.fingerprint(), HasSubstr(part));
  EXPECT_EQ(device.fingerprint(), Device::open(std::to_string(device.info().index)).fingerprint());
}

TEST_F(DeviceTest, MovesBytesExactly) {
  std::vector<unsigned char> bytes(100'003);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(i * i / 7);
  const Buffer a = device.allocate(bytes.size()), b = device.allocate(bytes.size());
  device.write(a, bytes.data(), bytes.size());
  EXPECT_EQ(read<unsigned char>(a, bytes.size()), bytes);
  device.zero(b, bytes.size());
  device.copy(a, b, 1000, 77, 5);
  std::vector<unsigned char> expected(bytes.size(), 0);
  std::copy_n(bytes.begin() + 77, 1000, expected.begin() + 5);
  EXPECT_EQ(read<unsigned char>(b, bytes.size()), expected);
  const unsigned char small[3] = {1, 2, 3};
  device.write(b, small, 3, 50'001);
  std::copy_n(small, 3, expected.begin() + 50'001);
  unsigned char part[5];
  device.read(b, part, 5, 50'000);
  EXPECT_TRUE(std::equal(part, part + 5, expected.begin() + 50'000));
}

TEST_F(DeviceTest, ZeroesExactlyTheRange) {
  for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{4}, std::size_t{16}})
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{4}, std::size_t{15}, std::size_t{64}}) {
      std::vector<unsigned char> expected(100, 0xa5);
      const Buffer buffer = device.allocate(100);
      device.write(buffer, expected.data(), 100);
      device.zero(buffer, bytes, at);
      std::fill_n(expected.begin() + static_cast<long>(at), bytes, 0);
      EXPECT_EQ(read<unsigned char>(buffer, 100), expected) << bytes << " at " << at;
    }
}

TEST_F(DeviceTest, RangesOutsideABufferAreRefused) {
  const Buffer buffer = device.allocate(16);
  char bytes[32] = {};
  EXPECT_THAT(message_of<Error>([&] { device.write(buffer, bytes, 17); }),
              HasSubstr("writing 17 bytes at 0 of a buffer of 16 bytes"));
  EXPECT_THAT(message_of<Error>([&] { device.read(buffer, bytes, 8, 9); }), HasSubstr("reading 8 bytes at 9"));
  EXPECT_THROW(device.zero(buffer, 1, 16), Error);
  EXPECT_THROW(device.read(buffer, bytes, SIZE_MAX, 8), Error);  // must not wrap around
  EXPECT_THROW(device.copy(buffer, buffer, 4, 14, 0), Error);
  EXPECT_THROW(device.copy(buffer, buffer, 4, 0, 14), Error);
  EXPECT_THROW(device.write(Buffer(), bytes, 1), Error);
  EXPECT_NO_THROW(device.write(buffer, bytes, 0, 16));
}

TEST_F(DeviceTest, CountsMemory) {
  const std::size_t before = device.memory_now();
  device.reset_memory_peak();
  {
    const Buffer a = device.allocate(1000);
    const Buffer shared = a;
    const Buffer b = device.allocate(500);
    EXPECT_EQ(device.memory_now(), before + 1500);
    EXPECT_EQ(shared.handle(), a.handle());
    EXPECT_EQ(shared.bytes(), 1000u);
  }
  EXPECT_EQ(device.memory_now(), before);
  EXPECT_EQ(device.memory_peak(), before + 1500);
  device.reset_memory_peak();
  EXPECT_EQ(device.memory_peak(), before);
  EXPECT_EQ(device.allocate(0).bytes(), 1u);
  EXPECT_FALSE(Buffer());
}

TEST_F(DeviceTest, ABufferThatCannotFitIsADeviceErrorWithSizes) {
  const std::size_t too_large = device.info().max_allocation + 1;
  EXPECT_EQ(kind_of([&] { device.allocate(too_large); }), ErrorKind::Device);
  EXPECT_THAT(message_of<Error>([&] { device.allocate(too_large); }), HasSubstr(std::to_string(too_large)));
  EXPECT_THROW(device.allocate(SIZE_MAX), Error);
  const std::size_t held = device.memory_now();
  EXPECT_EQ(held, 0u);
}

TEST_F(DeviceTest, RoundsGlobalSizesUpInEveryDimension) {
  const Buffer out = device.allocate(6 * sizeof(unsigned));
  const Kernel kernel = device.kernel("test.cl", "sizes");
  device.launch(kernel, Range{{5, 3, 2}, {4, 2, 1}}, out);
  EXPECT_EQ(read<unsigned>(out, 6), (std::vector<unsigned>{8, 4, 2, 4, 2, 1}));
  device.launch(kernel, Range{{1, 1, 7}, {1, 1, 2}}, out);
  EXPECT_EQ(read<unsigned>(out, 6), (std::vector<unsigned>{1, 1, 8, 1, 1, 2}));
  device.launch(kernel, Range{{1, 1, 1}, {1, 4, 1}}, out);
  EXPECT_EQ(read<unsigned>(out, 6), (std::vector<unsigned>{1, 4, 1, 1, 4, 1}));
  device.launch(kernel, Range::of(100), out);
  EXPECT_EQ(read<unsigned>(out, 6), (std::vector<unsigned>{128, 1, 1, 64, 1, 1}));
}

TEST_F(DeviceTest, LaunchesOverTwoDimensionsWithAGuard) {
  constexpr int width = 71, height = 5;
  const Buffer out = device.allocate(sizeof(int) * width * height);
  device.launch(device.kernel("test.cl", "index2"), Range::of2(width, height), out, width, height);
  const std::vector<int> found = read<int>(out, width * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) ASSERT_EQ(found[y * width + x], 1000 * y + x);
}

TEST_F(DeviceTest, AGlobalSizeOfZeroLaunchesNothing) {
  const Buffer out = device.allocate(6 * sizeof(unsigned));
  device.zero(out, out.bytes());
  device.launch(device.kernel("test.cl", "sizes"), Range{{4, 0, 1}, {1, 1, 1}}, out);
  EXPECT_EQ(read<unsigned>(out, 6), std::vector<unsigned>(6, 0));
}

TEST_F(DeviceTest, PassesArgumentsOfEveryKind) {
  const Buffer out = device.allocate(8 * sizeof(float));
  const std::array<float, 4> v = {1.5f, 2.5f, 3.5f, 4.5f};
  device.launch(device.kernel("test.cl", "arguments"), Range::of(1, 1), out, -3, 0.25f, 7u, std::uint64_t{9} << 32, v,
                Arg::local(16));
  EXPECT_EQ(read<float>(out, 8), (std::vector<float>{-3, 0.25f, 7, 9, 1.5f, 2.5f, 3.5f, 4.5f}));
}

TEST_F(DeviceTest, WrongArgumentsNameTheKernel) {
  const Buffer x = device.allocate(64);
  const Kernel kernel = device.kernel("test.cl", "index2");
  EXPECT_THAT(message_of<Error>([&] { device.launch(kernel, Range::of(1), x, 1); }),
              HasSubstr("test.cl:index2: wrong number of kernel arguments (found 2, expected 3)"));
  const std::string message = message_of<Error>([&] { device.launch(kernel, Range::of(1), x, 1, 1.0); });
  EXPECT_THAT(
      message,
      HasSubstr("clSetKernelArg failed with CL_INVALID_ARG_SIZE (-51): argument 2 (8 bytes) of kernel test.cl:index2"));
  EXPECT_THAT(message, HasSubstr(device.info().name));
  EXPECT_THROW(device.launch(Kernel(), Range::of(1)), Error);
}

TEST_F(DeviceTest, ALaunchThatFailsNamesKernelAndSizes) {
  const Buffer x = device.allocate(64);
  const Kernel kernel = device.kernel("test.cl", "add");
  const Range together{{10, 1, 1}, {1 << 20, 1, 1}, true};
  const std::string message = message_of<Error>([&] { device.launch(kernel, together, x); });
  EXPECT_THAT(message, HasSubstr("clEnqueueNDRangeKernel failed with CL_INVALID_WORK_GROUP_SIZE"));
  EXPECT_THAT(message, HasSubstr("kernel test.cl:add, global 1048576x1x1, local 1048576x1x1"));
  EXPECT_THAT(message, HasSubstr(device.info().name));
  EXPECT_THROW(device.launch(kernel, Range::of(1, 0), x), Error);
}

TEST_F(DeviceTest, BuildsOncePerFileDefinesAndPrecision) {
  const int before = device.builds();
  EXPECT_EQ(device.kernel("test.cl", "add").name(), "add");
  device.kernel("test.cl", "sizes");
  device.kernel("test.cl", "add", Defines{});
  EXPECT_EQ(device.builds(), before + 1);
  device.kernel("test.cl", "add", {{"ADD", "5"}});
  device.kernel("test.cl", "add", {{"ADD", "5"}});
  EXPECT_EQ(device.builds(), before + 2);
  EXPECT_GT(device.build_seconds(), 0);
  const Buffer x = device.allocate(sizeof(int));
  device.zero(x, sizeof(int));
  device.launch(device.kernel("test.cl", "add", {{"ADD", "5"}}), Range::of(1, 1), x);
  device.launch(device.kernel("test.cl", "add"), Range::of(1, 1), x);
  EXPECT_EQ(read<int>(x, 1), std::vector<int>{6});
}

TEST_F(DeviceTest, DoubleIsAnotherProgramOfTheSameSource) {
  if (!device.has_double()) {
    EXPECT_EQ(kind_of([&] { device.kernel("test.cl", "add", {}, Precision::Double); }), ErrorKind::Device);
    return;
  }
  folder.write("precision.cl",
               "#ifdef CLERESTORY_DOUBLE\n#define SIZE 8\n#else\n#define SIZE 4\n#endif\nkernel void size(global int "
               "*x) { x[0] = SIZE; }\n");
  const Buffer x = device.allocate(sizeof(int));
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    {
      ScopedVariable own("CLERESTORY_KERNELS", "");  // so does the first kernel in double precision
      device.kernel("tensor/accumulate.cl", "accumulate", {}, precision);
    }
    device.launch(device.kernel("precision.cl", "size", {}, precision), Range::of(1, 1), x);
    EXPECT_EQ(read<int>(x, 1)[0], static_cast<int>(real_size(precision)));
  }
}

TEST_F(DeviceTest, AnUnknownKernelNamesThoseThereAre) {
  const std::string message = message_of<Error>([&] { device.kernel("test.cl", "only_twice"); });
  EXPECT_THAT(message, HasSubstr("test.cl: no kernel \"only_twice\""));
  EXPECT_THAT(message, HasSubstr("index2"));
  EXPECT_NO_THROW(device.kernel("test.cl", "only_twice", {{"TWICE", ""}}));
  EXPECT_THAT(message_of<Error>([&] { device.kernel("none.cl", "x"); }), HasSubstr("none.cl"));
}

TEST_F(DeviceTest, ABuildFailureCarriesFileAndLine) {
  folder.write("lib/bad.clh", "#pragma once\n\nfloat f(void) { return undeclared_name; }\n");
  folder.write("uses_bad.cl", "#include \"lib/bad.clh\"\nkernel void k(void) { f(); }\n");
  folder.write("bad.cl", "#include \"lib/fine.clh\"\n\n\nkernel void k(void) { int x = ; }\n");
  folder.write("lib/fine.clh", "#pragma once\nint fine(void);\n");
  EXPECT_EQ(kind_of([&] { device.kernel("bad.cl", "k"); }), ErrorKind::Device);
  const std::string message = message_of<Error>([&] { device.kernel("bad.cl", "k", {{"SOME", "1"}}); });
  EXPECT_THAT(message, HasSubstr(folder.string() + "/bad.cl:4:"));
  EXPECT_THAT(message, HasSubstr("-DSOME=1"));
  EXPECT_THAT(message, HasSubstr(device.info().name));
  const std::string header = message_of<Error>([&] { device.kernel("uses_bad.cl", "k"); });
  EXPECT_THAT(header, HasSubstr("lib/bad.clh:3:"));
  EXPECT_THAT(header, HasSubstr("undeclared_name"));
}

TEST_F(DeviceTest, ProfilesWhatIsLaunchedWhileOn) {
  const Buffer x = device.allocate(4096 * sizeof(int)), y = device.allocate(x.bytes());
  device.zero(x, x.bytes());
  const Kernel kernel = device.kernel("test.cl", "add");
  device.launch(kernel, Range::of(4096), x);
  EXPECT_TRUE(device.profile().empty());
  device.set_profiling(true);
  for (int i = 0; i < 5000; ++i) device.launch(kernel, Range::of(4096), x);  // more than are kept as events
  device.copy(x, y, x.bytes());
  const std::vector<KernelProfile> profile = device.profile();
  ASSERT_EQ(profile.size(), 2u);
  EXPECT_EQ(profile[0].kernel, "test.cl:add");
  EXPECT_EQ(profile[0].launches, 5000);
  EXPECT_GT(profile[0].seconds, 0);
  EXPECT_EQ(profile[1].kernel, "(copy)");
  device.set_profiling(false);
  device.launch(kernel, Range::of(4096), x);
  EXPECT_EQ(device.profile()[0].launches, 5000);
  device.reset_profile();
  EXPECT_TRUE(device.profile().empty());
  EXPECT_EQ(read<int>(y, 1)[0], 5001);
}

// A training step makes about 2000 launches: the look-up and the launch itself have to be cheap. The bound on the
// look-up is a hundred times what it takes, so that a busy machine does not fail it.
TEST_F(DeviceTest, TellsAndListsTheVariantsThatAreLaunched) {
  const ScopedVariable list("CLERESTORY_LAUNCHES", (folder.path() / "launches").string());
  const Buffer x = device.allocate(4 * sizeof(int));
  device.zero(x, x.bytes());
  forget_launched();
  const Kernel one = device.kernel("test.cl", "add"),
               two = device.kernel("test.cl", "add", {{"ADD", "2"}, {"TWICE", ""}});
  device.kernel("test.cl", "only_twice", {{"ADD", "2"}, {"TWICE", ""}});  // made, not launched
  for (int i = 0; i < 3; ++i) device.launch(one, Range::of(4, 1), x), device.launch(two, Range::of(4, 1), x);
  const KernelVariant first{"test.cl", "add", {}}, second{"test.cl", "add", {{"ADD", "2"}, {"TWICE", ""}}};
  EXPECT_EQ(launched_variants(Precision::Single), (std::set{first, second}));
  EXPECT_TRUE(launched_variants(Precision::Double).empty());
  forget_launched();
  device.launch(two, Range::of(4, 1), x);
  EXPECT_EQ(launched_variants(Precision::Single), std::set{second});
  EXPECT_EQ(read_text(folder.path() / "launches"), "test.cl:add\ntest.cl:add ADD=2 TWICE\ntest.cl:add ADD=2 TWICE\n");
  device.finish();

  const ScopedVariable nowhere("CLERESTORY_LAUNCHES", (folder.path() / "none/launches").string());
  const Kernel index = device.kernel("test.cl", "sizes");
  EXPECT_THAT(message_of<Error>([&] { device.launch(index, Range::of(1, 1), device.allocate(24)); }),
              HasSubstr("CLERESTORY_LAUNCHES"));
}

TEST_F(DeviceTest, LookingAKernelUpIsCheap) {
  device.kernel("test.cl", "add");
  constexpr int count = 20'000;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i) device.kernel("test.cl", "add");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_LT(seconds / count, 2e-6);
}

}  // namespace
}  // namespace clerestory
