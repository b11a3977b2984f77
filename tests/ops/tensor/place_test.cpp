// How chunks meet the whole picture: each kernel of kernels/tensor/place.cl alone, in whole numbers, which are exact.
#include <gtest/gtest.h>

#include "host/cl/device.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

// Two pictures of 2 channels and 3 pixels, the chunk's pixels 2, 3, 4 of 6: the end of one and the start of the other.
constexpr int kBatch = 2, kChannels = 2, kPlane = 3, kFirst = 2, kPixels = 3, kCapacity = 4;
using Numbers = std::vector<float>;

/// A buffer as a tensor argument of a kernel: offset 0, so many elements from batch item to batch item.
class Placed : public testing::Test {
 protected:
  template <class T>
  Buffer upload(const std::vector<T>& values) {
    const Buffer buffer = device_.allocate(values.size() * sizeof(T));
    device_.write(buffer, values.data(), buffer.bytes());
    return buffer;
  }
  template <class T>
  std::vector<T> download(const Buffer& buffer) {
    std::vector<T> values(buffer.bytes() / sizeof(T));
    device_.read(buffer, values.data(), buffer.bytes());
    return values;
  }
  template <class... Args>
  void launch(const char* kernel, const Range& range, const Buffer& in, int in_stride, const Buffer& out,
              int out_stride, Args... args) {
    const std::uint64_t offset = 0;
    device_.launch(device_.kernel("tensor/place.cl", kernel), range, in, offset, in_stride, out, offset, out_stride,
                   args...);
  }
  Numbers placed(int rule, const Numbers& before) {
    const Buffer whole = upload(before);
    launch("place", Range::of2(kPixels, kChannels), upload(tile_), kChannels * kCapacity, whole, kChannels * kPlane,
           kFirst, kPixels, kCapacity, kPlane, rule);
    return download<float>(whole);
  }

  Device device_ = test_device();
  // By channel; the last pixel lies beyond the chunk.
  const Numbers tile_{10, 20, 30, 99, 40, 50, 60, 99};
  // By picture and channel.
  const Numbers whole_{1, 2, 3, 4, 5, 6, 7, 8, 9, -1, -2, -3};
};

TEST_F(Placed, PutsAddsOrKeepsWhatIsThere) {
  EXPECT_EQ(placed(0, whole_), (Numbers{1, 2, 10, 4, 5, 40, 20, 30, 9, 50, 60, -3}));
  EXPECT_EQ(placed(1, whole_), (Numbers{1, 2, 13, 4, 5, 46, 27, 38, 9, 49, 58, -3}));
  Numbers gaps = whole_;
  gaps[2] = gaps[10] = 0;
  EXPECT_EQ(placed(2, gaps), (Numbers{1, 2, 10, 4, 5, 6, 7, 8, 9, -1, 60, -3}));
}

TEST_F(Placed, TakesAChunkWithZerosBeyondIt) {
  const Buffer tile = upload(Numbers(kChannels * kCapacity, -7));
  launch("take", Range::of2(kCapacity, kChannels), upload(whole_), kChannels * kPlane, tile, kChannels * kCapacity,
         kFirst, kPixels, kCapacity, kPlane);
  EXPECT_EQ(download<float>(tile), (Numbers{3, 7, 8, 0, 6, -1, -2, 0}));
}

TEST_F(Placed, PutsIntoZerosAsTheTransposeOfTaking) {
  const Buffer whole = upload(whole_);
  for (int n = 0; n < kBatch; ++n)
    launch("put", Range::of2(kPlane, kChannels), upload(tile_), kChannels * kCapacity, whole, kChannels * kPlane, n,
           kFirst, kPixels, kCapacity, kPlane);
  EXPECT_EQ(download<float>(whole), (Numbers{0, 0, 10, 0, 0, 40, 20, 30, 0, 50, 60, 0}));
}

TEST_F(Placed, TotalsBeginWithTheFirstChunk) {
  const Buffer total = upload(Numbers{5, 6, 7});
  const Buffer part = upload(Numbers{1, 2, 3});
  launch("add_total", Range::of(3), part, 0, total, 0, 3, 0);
  EXPECT_EQ(download<float>(total), (Numbers{1, 2, 3}));
  launch("add_total", Range::of(3), part, 0, total, 0, 2, 1);
  EXPECT_EQ(download<float>(total), (Numbers{2, 4, 3}));
}

TEST_F(Placed, TotalsOfIntegersWrapAround) {
  using Integers = std::vector<int>;
  const Buffer total = upload(Integers{0x7fffffff, 5}), part = upload(Integers{1, 4});
  launch("add_total_int", Range::of(2), part, 0, total, 0, 2, 1);
  EXPECT_EQ(download<int>(total), (Integers{-0x7fffffff - 1, 9}));
  launch("add_total_int", Range::of(2), part, 0, total, 0, 2, 0);
  EXPECT_EQ(download<int>(total), (Integers{1, 4}));
}

}  // namespace
}  // namespace clerestory
