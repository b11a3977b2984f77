// One OpenCL device with its in-order queue: memory, programs, launches and their profile.
// Everything above this room sees OpenCL only through these classes.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/error.hpp"

// Raw handles, for the CLBlast backend only.
typedef struct _cl_mem* cl_mem;
typedef struct _cl_command_queue* cl_command_queue;

namespace clerestory {

enum class Precision { Single, Double };
inline std::size_t real_size(Precision p) { return p == Precision::Single ? 4 : 8; }

struct DeviceInfo {
  int index = 0;  // position in `clerestory devices`
  std::string platform, name, vendor, version, driver;
  bool cpu = false, fp64 = false, unified_memory = false;
  int compute_units = 0;
  int float_width = 0;                                           // floats of a vector, as the driver says
  std::size_t max_group = 0;                                     // work-items
  std::size_t memory = 0, max_allocation = 0, local_memory = 0;  // bytes
  /// What a kernel may ask of the local memory, in bytes: an eighth is left to the driver's own use.
  std::size_t local_room() const { return local_memory / 8 * 7; }
};

/// Devices of every platform; a platform that is empty or fails to answer is passed over.
std::vector<DeviceInfo> list_devices();
/// Why there is none: the loader's folder of drivers, a driver that cannot be loaded, PoCL's cache, each by its name
/// and the variable behind it.
std::string why_no_device();

struct Tile;

/// Device memory. Copies share it; it is freed with the last copy.
class Buffer {
 public:
  Buffer() = default;
  std::size_t bytes() const;
  cl_mem handle() const;
  explicit operator bool() const { return static_cast<bool>(memory_); }

 private:
  friend class Device;
  struct Memory;
  std::shared_ptr<Memory> memory_;
};

/// A kernel of a built program. Cheap to copy.
class Kernel {
 public:
  Kernel() = default;
  const std::string& name() const;
  explicit operator bool() const { return static_cast<bool>(state_); }

 private:
  friend class Device;
  struct State;
  std::shared_ptr<State> state_;
};

/// Global and local sizes of a launch. `global` is rounded up to a multiple of `local`; kernels guard by arguments.
/// A global size of zero launches nothing.
struct Range {
  std::array<std::size_t, 3> global{1, 1, 1};
  std::array<std::size_t, 3> local{1, 1, 1};
  /// Work-items of a group work together: `local` is what the kernel was built for. Otherwise it is a wish, and a
  /// device with smaller groups takes smaller ones.
  bool together = false;
  static Range of(std::size_t count, std::size_t local = 64) { return {{count, 1, 1}, {local, 1, 1}}; }
  static Range of2(std::size_t x, std::size_t y, std::size_t local_x = 64, std::size_t local_y = 1) {
    return {{x, y, 1}, {local_x, local_y, 1}};
  }
};

/// -D switches of a program: features only, numbers that vary travel as arguments.
using Defines = std::map<std::string, std::string>;

/// One kernel argument: a buffer, `local` memory, or plain data (int, float, double, uint, long, ulong, float4 as an
/// array).
class Arg {
 public:
  Arg(const Buffer& b) : buffer_(b.handle()), is_buffer_(true) {}
  template <class T>
  requires std::is_trivially_copyable_v<T> &&(sizeof(T) <= 64) Arg(const T& value) : size_(sizeof(T)) {
    __builtin_memcpy(data_.data(), &value, sizeof(T));
  }
  static Arg local(std::size_t bytes) {
    Arg a;
    a.size_ = bytes, a.is_local_ = true;
    return a;
  }
  const void* data() const {
    return is_local_ ? nullptr : is_buffer_ ? static_cast<const void*>(&buffer_) : data_.data();
  }
  std::size_t size() const { return is_buffer_ ? sizeof(cl_mem) : size_; }

 private:
  Arg() = default;
  alignas(16) std::array<unsigned char, 64> data_{};
  cl_mem buffer_ = nullptr;
  std::size_t size_ = 0;
  bool is_buffer_ = false, is_local_ = false;
};

/// What one kernel did while profiling was on.
struct KernelProfile {
  std::string kernel;  // "nn/pool.cl:forward"; "(copy)" and "(zero)" for those two calls
  long launches = 0;
  double seconds = 0;
};

class Device {
 public:
  /// Opens the device whose index equals `selector`, or whose platform or name contains it (letter case ignored);
  /// empty: the environment variable CLERESTORY_DEVICE, else the first device. Only one that passes the probe is
  /// opened, of several the first that does. Throws ErrorKind::Device, with the devices there are or why they were
  /// refused.
  static Device open(const std::string& selector = {});

  const DeviceInfo& info() const;
  /// Identity of device, driver and compiler: key of tuning data and program caches.
  std::string fingerprint() const;
  bool has_double() const { return info().fp64; }

  /// Contents undefined; zero bytes allocate one. Throws ErrorKind::Device when it does not fit, with what is held.
  Buffer allocate(std::size_t bytes);
  // Byte ranges outside the buffer throw; of zero bytes nothing is done. The host's memory may go when a call returns.
  void write(const Buffer& to, const void* from, std::size_t bytes, std::size_t at = 0);
  void read(const Buffer& from, void* to, std::size_t bytes, std::size_t at = 0);  // waits for the queue
  void copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t from_at = 0, std::size_t to_at = 0);
  void zero(const Buffer& to, std::size_t bytes, std::size_t at = 0);

  /// Kernel `name` of the source `file` ("nn/pool.cl"), built once per set of defines. REAL and the real types follow
  /// `precision` (kernels/lib/real.clh). A build failure throws with the compiler's log, naming file and line; so does
  /// double precision on a device without it, or that fails the probe in it. Asking again costs a hash lookup (20 ns).
  Kernel kernel(std::string_view file, std::string_view name, const Defines& defines = {},
                Precision precision = Precision::Single);

  template <class... Args>
  void launch(const Kernel& kernel, const Range& range, const Args&... args) {
    launch_with(kernel, range, {Arg(args)...});
  }
  void launch_with(const Kernel& kernel, const Range& range, const std::vector<Arg>& args);

  void finish();

  /// The register tile of packed kernels: the one that use_tile named, else the fastest, measured or remembered at the
  /// first call (host/cl/tile.hpp).
  const Tile& tile();
  void use_tile(const std::string& name);  // "auto": the fastest

  /// Who multiplies in plans that leave it open (PlanOptions::gemm): one of gemm_choices(); auto at first.
  const std::string& gemm() const;
  void use_gemm(const std::string& name);

  /// Bytes of device memory held now, and the most so far since the last reset.
  std::size_t memory_now() const;
  std::size_t memory_peak() const;
  void reset_memory_peak();

  /// Per-kernel times, collected while on. Off at first; profile() waits for the queue, slowest kernel first.
  /// Switching waits too, and makes a new queue.
  void set_profiling(bool on);
  std::vector<KernelProfile> profile();
  void reset_profile();

  /// Seconds spent building programs so far, and how many were built from source. Some drivers (PoCL) do the larger
  /// part of compiling at the first launch with a new local size: of kernels that are built for the first time, their
  /// first launch is in it.
  double build_seconds() const;
  int builds() const;

  cl_command_queue queue() const;  // for CLBlast; until the next set_profiling

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// What this process has built that no cache had, on all its devices together.
struct FirstBuilds {
  std::string device;  // the last one's name; empty when there was nothing to build
  double seconds = 0;  // with first launches, see Device::build_seconds
};
FirstBuilds first_builds();

/// Text of a kernel source with its includes put in, from the binary or from CLERESTORY_KERNELS.
std::string kernel_source(std::string_view file);
/// Names of all embedded sources ("nn/pool.cl", "lib/ggx.clh"), sorted.
std::vector<std::string> kernel_files();
/// Identity of the code of all sources together, as 16 hexadecimal digits: of those in the binary, or in
/// CLERESTORY_KERNELS. Comments and blanks have no say: what was measured with the same code does not get stale.
std::string kernels_hash();
/// The same of one source with what it includes.
std::string kernel_hash(std::string_view file);
/// What this process has built programs of, on all its devices: "kernels/nn/pool.cl" and its kernel_hash().
std::map<std::string, std::string> built_kernels();

}  // namespace clerestory
