// How chunks meet the whole picture: in whole numbers, which are exact in both precisions.
#include <cstdint>

#include "checks/kernel_check.hpp"
#include "host/cl/small_integers.hpp"

namespace clerestory {
namespace {

// Three pictures of 3 channels and 7 pixels, the chunk's 9 of their 21: the end of one and the start of the next. The
// tile holds 11 columns, two of them beyond the chunk.
constexpr int kBatch = 3, kChannels = 3, kPlane = 7, kFirst = 5, kPixels = 9, kCapacity = 11;
constexpr double kCanary = 12345.5;
using Numbers = std::vector<double>;

std::size_t in_whole(int channel, int pixel) {
  return static_cast<std::size_t>((pixel / kPlane * kChannels + channel) * kPlane + pixel % kPlane);
}
std::size_t in_tile(int channel, int column) { return static_cast<std::size_t>(channel * kCapacity + column); }

/// The kernels in one precision on one device.
template <class Real>
class Placed {
 public:
  Placed(const Device& device, OpFindings& findings) : device_(device), findings_(findings) {}

  void all() {
    for (const int rule : {0, 1, 2}) place(rule);
    take(), put();
    add<Real>("add_total"), add<std::int32_t>("add_total_int");
  }

 private:
  static constexpr Precision kPrecision = sizeof(Real) == 4 ? Precision::Single : Precision::Double;

  template <class... Args>
  void launch(const char* kernel, const Range& range, const Buffer& in, int in_stride, const Buffer& out,
              int out_stride, Args... args) {
    const std::uint64_t offset = 0;
    device_.launch(device_.kernel("tensor/place.cl", kernel, {}, kPrecision), range, in, offset, in_stride, out, offset,
                   out_stride, args...);
  }

  /// 0: put, 1: added, 2: where there is a zero.
  void place(int rule) {
    std::vector<Real> before = whole_;
    for (std::size_t i = 0; i < before.size(); i += 3) before[i] = 0;
    Numbers want(before.begin(), before.end());
    for (int p = 0; p < kPixels; ++p)
      for (int c = 0; c < kChannels; ++c) {
        double& to = want[in_whole(c, kFirst + p)];
        const double from = static_cast<double>(tile_[in_tile(c, p)]);
        to = rule == 0 ? from : rule == 1 ? to + from : to == 0 ? from : to;
      }
    const Buffer whole = uploaded(device_, before);
    launch("place", Range::of2(kPixels, kChannels), uploaded(device_, tile_), kChannels * kCapacity, whole,
           kChannels * kPlane, kFirst, kPixels, kCapacity, kPlane, rule);
    expect_close(findings_, fmt::format("place, rule {}", rule), downloaded<Real>(device_, whole), want, 0);
  }

  void take() {
    Numbers want(tile_.size(), 0);
    for (int p = 0; p < kPixels; ++p)
      for (int c = 0; c < kChannels; ++c) want[in_tile(c, p)] = static_cast<double>(whole_[in_whole(c, kFirst + p)]);
    want.push_back(kCanary);
    const Buffer tile = uploaded(device_, std::vector<Real>(want.size(), static_cast<Real>(kCanary)));
    launch("take", Range::of2(kCapacity, kChannels), uploaded(device_, whole_), kChannels * kPlane, tile,
           kChannels * kCapacity, kFirst, kPixels, kCapacity, kPlane);
    expect_close(findings_, "take", downloaded<Real>(device_, tile), want, 0);
  }

  void put() {
    Numbers want(whole_.size(), 0);
    for (int p = 0; p < kPixels; ++p)
      for (int c = 0; c < kChannels; ++c) want[in_whole(c, kFirst + p)] = static_cast<double>(tile_[in_tile(c, p)]);
    want.push_back(kCanary);
    const Buffer whole = uploaded(device_, std::vector<Real>(want.size(), static_cast<Real>(kCanary)));
    for (int n = 0; n < kBatch; ++n)
      launch("put", Range::of2(kPlane, kChannels), uploaded(device_, tile_), kChannels * kCapacity, whole,
             kChannels * kPlane, n, kFirst, kPixels, kCapacity, kPlane);
    expect_close(findings_, "put", downloaded<Real>(device_, whole), want, 0);
  }

  /// Totals begin with the first chunk; what lies behind their 67 numbers stays.
  template <class T>
  void add(const char* kernel) {
    constexpr int count = 67;
    const std::vector<T> before = small_integers<T>(count + 1, 3, 8), part = small_integers<T>(count, 4, 8);
    for (const int adds : {0, 1}) {
      Numbers want(before.begin(), before.end());
      for (std::size_t i = 0; i < count; ++i) want[i] = static_cast<double>(part[i] + (adds ? before[i] : 0));
      const Buffer total = uploaded(device_, before);
      launch(kernel, Range::of(count), uploaded(device_, part), 0, total, 0, count, adds);
      expect_close(findings_, kernel, downloaded<T>(device_, total), want, 0);
    }
  }

  Device device_;
  OpFindings& findings_;
  const std::vector<Real> tile_ = small_integers<Real>(kChannels * kCapacity, 1, 8),
                          whole_ = small_integers<Real>(kBatch * kChannels * kPlane, 2, 8);
};

}  // namespace

KERNEL_CHECK(place) {
  return {.stem = "place",
          .kernels = {"place", "add_total", "add_total_int", "take", "put"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            Placed<float>(devices.single, findings).all();
            if (devices.with_doubles) Placed<double>(*devices.with_doubles, findings).all();
          }};
}

}  // namespace clerestory
