// Devices that have less than this machine's.
#include "host/cl/pretend.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

struct PretendTest : testing::Test {
  PretendTest() {
    folder.write("test.cl",
                 "kernel void add(global int *x) { x[get_global_id(0)] += 1; }\n"
                 "kernel void other(global int *x) { x[0] = 1; }\n");
  }
  /// Then kernels are those above.
  Device open(const std::string& less) {
    kernels.reset();
    const ScopedVariable variable("CLERESTORY_PRETEND", less);
    Device device = Device::open();
    kernels.emplace("CLERESTORY_KERNELS", folder.string());
    return device;
  }

  ScopedFolder folder;
  std::optional<ScopedVariable> kernels;
};

TEST_F(PretendTest, OnlyTakesAway) {
  const DeviceInfo whole = open("").info(),
                   less = open("no_fp64,no_unified_memory,max_group=16,max_allocation=3").info(),
                   more = open("max_group=4000000000,memory=4000000000,local_memory=4000000000").info();
  EXPECT_FALSE(less.fp64 || less.unified_memory);
  EXPECT_EQ(less.max_group, 16u);
  EXPECT_EQ(less.max_allocation, 3u << 20);
  EXPECT_EQ(less.memory, whole.memory);
  EXPECT_EQ(more.max_group, whole.max_group);
  EXPECT_EQ(more.memory, whole.memory);
  EXPECT_EQ(more.local_memory, whole.local_memory);
}

TEST_F(PretendTest, OtherWordsAreRefused) {
  for (const char* word : {"no_fp32", "max_group", "max_group=", "max_group=many", "max_group=-1", "no_fp64=1"}) {
    const std::string said = message_of([&] { open(word); }, ErrorKind::Usage);
    EXPECT_THAT(said, HasSubstr("CLERESTORY_PRETEND")) << word;
    EXPECT_THAT(said, HasSubstr(word));
  }
}

TEST_F(PretendTest, WithoutDoubles) {
  Device device = open("no_fp64");
  EXPECT_THAT(message_of([&] { device.kernel("test.cl", "other", {}, Precision::Double); }, ErrorKind::Device),
              HasSubstr("has no double precision"));
}

TEST_F(PretendTest, WithoutSharedMemoryBytesMoveExactly) {
  Device device = open("no_unified_memory");
  std::vector<int> numbers(1000), back(500);
  std::iota(numbers.begin(), numbers.end(), 7);
  const Buffer buffer = device.allocate(4000);
  device.write(buffer, numbers.data(), 4000);
  device.launch(device.kernel("test.cl", "add"), Range::of(1000, 8), buffer);
  device.read(buffer, back.data(), 2000, 1200);
  for (int i = 0; i < 500; ++i) ASSERT_EQ(back[static_cast<std::size_t>(i)], 7 + 300 + i + 1);
}

TEST_F(PretendTest, GroupsThatAreTooLargeNameKernelAndSizes) {
  Device device = open("max_group=16");
  const Buffer buffer = device.allocate(256);
  device.zero(buffer, 256);
  const Kernel add = device.kernel("test.cl", "add");
  const auto launch = [&](std::size_t local) { device.launch(add, Range{{64, 1, 1}, {local, 1, 1}, true}, buffer); };
  const std::string said = message_of([&] { launch(32); }, ErrorKind::Device);
  EXPECT_THAT(said, HasSubstr("CL_INVALID_WORK_GROUP_SIZE"));
  EXPECT_THAT(said, HasSubstr("kernel test.cl:add, global 64x1x1, local 32x1x1"));
  launch(16);
  device.finish();
}

TEST_F(PretendTest, GroupsThatDoNotWorkTogetherAreAsSmallAsTheDeviceWants) {
  for (const auto& [most, items] : {std::pair{1, 90}, {7, 92}, {24, 96}, {4096, 96}}) {
    Device device = open(fmt::format("max_group={}", most));
    const Buffer buffer = device.allocate(400);
    device.zero(buffer, 400);
    device.launch(device.kernel("test.cl", "add"), Range::of(90, 32), buffer);
    std::vector<int> counts(100);
    device.read(buffer, counts.data(), 400);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(counts[static_cast<std::size_t>(i)], i < items) << most << " " << i;
  }
}

TEST_F(PretendTest, BuffersThatAreTooLargeAreRefused) {
  Device device = open("max_allocation=1,memory=2");
  EXPECT_THAT(message_of([&] { device.allocate((1 << 20) + 1); }, ErrorKind::Device), HasSubstr("one buffer may have"));
  const Buffer first = device.allocate(1 << 20), second = device.allocate(1 << 20);
  EXPECT_THAT(message_of([&] { device.allocate(1); }, ErrorKind::Device), HasSubstr("in all there are"));
}

TEST_F(PretendTest, ALostDeviceAnswersNothingAnyMore) {
  Device probed = open("");  // so that the probe's verdict is known, and launches nothing below
  Device device = open("lost_after=3");
  const Buffer buffer = device.allocate(256);
  device.zero(buffer, 256);
  const Kernel add = device.kernel("test.cl", "add");
  for (int i = 0; i < 3; ++i) device.launch(add, Range::of(64), buffer);
  int first = 0;
  device.read(buffer, &first, sizeof first);
  EXPECT_EQ(first, 3);
  EXPECT_THAT(message_of([&] { device.launch(add, Range::of(64), buffer); }, ErrorKind::Device),
              HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
  EXPECT_THAT(message_of([&] { device.read(buffer, &first, sizeof first); }, ErrorKind::Device),
              HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
  EXPECT_THAT(message_of([&] { device.finish(); }, ErrorKind::Device), HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
}

}  // namespace
}  // namespace clerestory
