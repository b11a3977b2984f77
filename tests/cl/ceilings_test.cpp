// The measured ceilings are of work that is really done.
#include "host/cl/ceilings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clerestory {
namespace {

TEST(Ceilings, ArePositiveAndRoundTripsCostMoreThanLaunches) {
  Device device = Device::open();
  const Ceilings c = measure_ceilings(device);
  EXPECT_GT(c.fma_gflops, 0.1);
  EXPECT_GT(c.bandwidth_gbs, 0.1);
  EXPECT_GT(c.launch_us, 0.01);
  EXPECT_GT(c.round_trip_us, c.launch_us);
  EXPECT_EQ(device.memory_now(), 0u);
  EXPECT_THAT(describe(c), testing::HasSubstr("GFLOP/s"));
}

// Nothing of the chain of multiply-adds may be left away by a compiler: ten times the rounds take about ten times as
// long. The bound of five leaves room for a busy machine, and an eliminated loop would give one.
TEST(Ceilings, TheLoopIsReallyRun) {
  Device device = Device::open();
  const std::size_t items = 64;
  const Buffer out = device.allocate(items * 16 * sizeof(float));
  const Kernel kernel = device.kernel("tensor/ceilings.cl", "fma_wide");
  device.set_profiling(true);
  const auto seconds = [&](int rounds) {
    double best = 1e9;
    for (int i = 0; i < 5; ++i) {
      device.reset_profile();
      device.launch(kernel, Range::of(items, 1), out, rounds, 0.999f, 0.001f);
      best = std::min(best, device.profile().at(0).seconds);
    }
    return best;
  };
  seconds(10);
  EXPECT_GT(seconds(100'000), 5 * seconds(10'000));
}

}  // namespace
}  // namespace clerestory
