#include "host/cl/device.hpp"

#include <CL/opencl.hpp>
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <unordered_map>
#include <utility>

#include "host/cl/launch_mark.hpp"
#include "host/cl/platforms.hpp"
#include "host/cl/probe.hpp"
#include "host/cl/profiler.hpp"
#include "host/cl/program.hpp"
#include "host/cl/seconds_of.hpp"
#include "host/cl/tile.hpp"

namespace clerestory {
namespace {

struct MemoryCount {
  std::size_t now = 0, peak = 0;
};

struct KernelKey {
  std::string file, name;
  Defines defines;
  Precision precision;
};

// The same, not owning: looking a kernel up must not allocate.
struct KernelKeyView {
  std::string_view file, name;
  const Defines& defines;
  Precision precision;
  KernelKeyView(std::string_view f, std::string_view n, const Defines& d, Precision p)
      : file(f), name(n), defines(d), precision(p) {}
  KernelKeyView(const KernelKey& key) : KernelKeyView(key.file, key.name, key.defines, key.precision) {}
};

struct KernelKeyHash {
  using is_transparent = void;
  std::size_t operator()(const KernelKeyView& key) const {
    const std::hash<std::string_view> hash;
    std::size_t h = hash(key.file) * 31 + hash(key.name) + static_cast<std::size_t>(key.precision);
    for (const auto& [name, value] : key.defines) h = (h * 31 + hash(name)) * 31 + hash(value);
    return h;
  }
};

struct KernelKeyEqual {
  using is_transparent = void;
  bool operator()(const KernelKeyView& a, const KernelKeyView& b) const {
    return a.precision == b.precision && a.name == b.name && a.file == b.file && a.defines == b.defines;
  }
};

std::string describe_sizes(const std::array<std::size_t, 3>& sizes) {
  return fmt::format("{}x{}x{}", sizes[0], sizes[1], sizes[2]);
}

// One pattern word as wide as the range allows: drivers fill wide words faster.
template <class Word>
void fill(const cl::CommandQueue& queue, cl_mem memory, std::size_t bytes, std::size_t at, cl_event* event) {
  const Word word{};
  const cl_int code = clEnqueueFillBuffer(queue(), memory, &word, sizeof word, at, bytes, 0, nullptr, event);
  if (code != CL_SUCCESS) throw cl::Error(code, "clEnqueueFillBuffer");
}

const std::string copy_name = "(copy)", zero_name = "(zero)";

}  // namespace

struct Buffer::Memory {
  cl::Buffer buffer;
  std::size_t bytes;
  std::shared_ptr<MemoryCount> count;
  Memory(cl::Buffer b, std::size_t n, std::shared_ptr<MemoryCount> c)
      : buffer(std::move(b)), bytes(n), count(std::move(c)) {
    count->now += bytes;
    count->peak = std::max(count->peak, count->now);
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() { count->now -= bytes; }
};

struct Kernel::State {
  cl::Kernel kernel;
  std::string name, label;  // label: "nn/pool.cl:forward"
  std::size_t arguments;
  bool first;  // built for the first time and not launched yet
  LaunchMark mark;
};

struct Device::State {
  struct Program {
    cl::Program program;
    bool first;  // built for the first time
  };

  FoundDevice found;
  std::string fingerprint;
  cl::Context context;
  cl::CommandQueue queue;
  std::unique_ptr<ProgramBuilder> builder;
  std::unordered_map<KernelKey, Kernel, KernelKeyHash, KernelKeyEqual> kernels;
  std::unordered_map<KernelKey, Program, KernelKeyHash, KernelKeyEqual> programs;  // their name is empty
  std::shared_ptr<MemoryCount> memory = std::make_shared<MemoryCount>();
  bool profiling = false;
  const Tile* tile = nullptr;  // null: not chosen yet
  std::string gemm = "auto";
  bool double_trusted = false;  // has passed the probe in double precision
  Profiler profiler;            // goes before the kernels that its names belong to
  int launches_since_flush = 0;
  std::size_t launches = 0;
  const std::string* last_launched = nullptr;  // label; what fails on the device is often reported by a later call

  explicit State(const FoundDevice& device);
  std::string describe() const { return fmt::format("{} ({})", found.info.name, found.info.platform); }

  /// Runs an OpenCL call; its failure is reported with what was being done, said by `doing` only then.
  template <class Call, class Doing>
  auto checked(Call call, Doing doing) const {
    try {
      return call();
    } catch (const cl::Error& error) {
      throw Error(ErrorKind::Device,
                  fmt::format("{} failed with {}: {}, on {}{}", error.what(), opencl_error_name(error.err()), doing(),
                              describe(), last_launched ? ", after launching " + *last_launched : ""));
    }
  }
  template <class Doing>
  void check(cl_int code, const char* call, Doing doing) const {
    if (found.lost_after && launches > *found.lost_after) code = CL_DEVICE_NOT_AVAILABLE;
    if (code != CL_SUCCESS) checked([&] { throw cl::Error(code, call); }, doing);
  }

  void make_queue() {
    const cl_command_queue_properties properties = profiling ? CL_QUEUE_PROFILING_ENABLE : 0;
    queue = checked([&] { return cl::CommandQueue(context, cl::Device(found.id, true), properties); },
                    [] { return "making the queue"; });
  }
  void check_range(const Buffer& buffer, std::size_t bytes, std::size_t at, const char* doing) const {
    if (!buffer) throw Error(ErrorKind::Failed, fmt::format("{} a buffer that was never allocated", doing));
    if (at > buffer.bytes() || bytes > buffer.bytes() - at)
      throw Error(ErrorKind::Failed,
                  fmt::format("{} {} bytes at {} of a buffer of {} bytes", doing, bytes, at, buffer.bytes()));
  }
  /// Host access to part of a buffer: mapped where the device shares the host's memory.
  template <class Copy>
  void map(const Buffer& buffer, cl_map_flags flags, std::size_t bytes, std::size_t at, Copy copy) const {
    const auto doing = [&] { return fmt::format("mapping {} bytes at {} of {}", bytes, at, buffer.bytes()); };
    cl_int code = CL_SUCCESS;
    void* host = clEnqueueMapBuffer(queue(), buffer.handle(), CL_TRUE, flags, at, bytes, 0, nullptr, nullptr, &code);
    check(code, "clEnqueueMapBuffer", doing);
    copy(host);
    check(clEnqueueUnmapMemObject(queue(), buffer.handle(), host, 0, nullptr, nullptr), "clEnqueueUnmapMemObject",
          doing);
  }
  const Program& program(std::string_view file, const Defines& defines, Precision precision);
  Kernel make_kernel(std::string_view file, std::string_view name, const Defines& defines, Precision precision);
};

std::size_t Buffer::bytes() const { return memory_ ? memory_->bytes : 0; }
cl_mem Buffer::handle() const { return memory_ ? memory_->buffer() : nullptr; }
const std::string& Kernel::name() const { return state_->name; }

// --- Opening
// ----------------------------------------------------------------------------------------------------------

Device::State::State(const FoundDevice& device) : found(device) {
  fingerprint = fingerprint_of(found);
  context = checked([&] { return cl::Context(cl::Device(found.id, true)); }, [] { return "making a context"; });
  make_queue();
  builder = std::make_unique<ProgramBuilder>(context(), found.id, found.info, fingerprint);
}

Device Device::open(const std::string& selector) {
  const char* variable = std::getenv("CLERESTORY_DEVICE");
  const std::string wanted = !selector.empty() ? selector : variable != nullptr ? variable : "";
  const std::vector<FoundDevice> devices = find_devices();
  if (devices.empty()) throw Error(ErrorKind::Device, why_no_device());
  const std::vector<FoundDevice> candidates = matching_devices(devices, wanted);
  if (candidates.empty())
    throw Error(ErrorKind::Device, "no such OpenCL device", selector.empty() ? "CLERESTORY_DEVICE" : "--device", wanted,
                "an index or part of a name of " + describe_devices(devices));
  std::string refused;
  for (const FoundDevice& candidate : candidates) {
    std::string fault;
    try {
      Device device;
      device.state_ = std::make_shared<State>(candidate);
      fault = remembered_probe_fault(device, Precision::Single);
      if (fault.empty()) return device;
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::Device) throw;
      fault = error.what();
    }
    refused +=
        fmt::format("\n  {}: {} ({}): {}", candidate.info.index, candidate.info.name, candidate.info.platform, fault);
  }
  throw Error(ErrorKind::Device, "no OpenCL device that computes correctly; refused:" + refused);
}

const DeviceInfo& Device::info() const { return state_->found.info; }
std::string Device::fingerprint() const { return state_->fingerprint; }
cl_command_queue Device::queue() const { return state_->queue(); }

// --- Memory
// -----------------------------------------------------------------------------------------------------------

Buffer Device::allocate(std::size_t bytes) {
  bytes = std::max<std::size_t>(bytes, 1);
  const State& s = *state_;
  const DeviceInfo& info = s.found.info;
  const auto refuse = [&](const char* limit, std::size_t allowed) {
    throw Error(ErrorKind::Device, fmt::format("{} of device memory do not fit on {}: {} held, {} {}", bytes,
                                               s.describe(), s.memory->now, limit, allowed));
  };
  if (bytes > info.max_allocation) refuse("bytes; one buffer may have", info.max_allocation);
  if (bytes > info.memory - std::min(s.memory->now, info.memory)) refuse("bytes; in all there are", info.memory);
  const cl_mem_flags flags = CL_MEM_READ_WRITE | (info.unified_memory ? CL_MEM_ALLOC_HOST_PTR : 0);
  cl::Buffer memory = s.checked([&] { return cl::Buffer(s.context, flags, bytes); },
                                [&] { return fmt::format("allocating {} bytes beside {}", bytes, s.memory->now); });
  Buffer buffer;
  buffer.memory_ = std::make_shared<Buffer::Memory>(std::move(memory), bytes, s.memory);
  return buffer;
}

void Device::write(const Buffer& to, const void* from, std::size_t bytes, std::size_t at) {
  const State& s = *state_;
  s.check_range(to, bytes, at, "writing");
  if (bytes == 0) return;
  if (s.found.info.unified_memory) {
    s.map(to, CL_MAP_WRITE_INVALIDATE_REGION, bytes, at, [&](void* host) { std::memcpy(host, from, bytes); });
  } else {
    s.check(clEnqueueWriteBuffer(s.queue(), to.handle(), CL_TRUE, at, bytes, from, 0, nullptr, nullptr),
            "clEnqueueWriteBuffer", [&] { return fmt::format("writing {} bytes at {} of {}", bytes, at, to.bytes()); });
  }
}

void Device::read(const Buffer& from, void* to, std::size_t bytes, std::size_t at) {
  const State& s = *state_;
  s.check_range(from, bytes, at, "reading");
  if (bytes == 0) return;
  if (s.found.info.unified_memory) {
    s.map(from, CL_MAP_READ, bytes, at, [&](const void* host) { std::memcpy(to, host, bytes); });
  } else {
    s.check(clEnqueueReadBuffer(s.queue(), from.handle(), CL_TRUE, at, bytes, to, 0, nullptr, nullptr),
            "clEnqueueReadBuffer",
            [&] { return fmt::format("reading {} bytes at {} of {}", bytes, at, from.bytes()); });
  }
}

void Device::copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t from_at, std::size_t to_at) {
  State& s = *state_;
  s.check_range(from, bytes, from_at, "copying");
  s.check_range(to, bytes, to_at, "copying to");
  if (bytes == 0) return;
  cl_event event = nullptr;
  s.check(clEnqueueCopyBuffer(s.queue(), from.handle(), to.handle(), from_at, to_at, bytes, 0, nullptr,
                              s.profiling ? &event : nullptr),
          "clEnqueueCopyBuffer", [&] { return fmt::format("copying {} bytes from {} to {}", bytes, from_at, to_at); });
  if (s.profiling) s.profiler.add(copy_name, event);
}

void Device::zero(const Buffer& to, std::size_t bytes, std::size_t at) {
  State& s = *state_;
  s.check_range(to, bytes, at, "clearing");
  if (bytes == 0) return;
  cl_event event = nullptr;
  s.checked(
      [&] {
        const auto filled = (bytes | at) % 16 == 0  ? fill<cl_float4>
                            : (bytes | at) % 4 == 0 ? fill<cl_uint>
                                                    : fill<cl_uchar>;
        filled(s.queue, to.handle(), bytes, at, s.profiling ? &event : nullptr);
      },
      [&] { return fmt::format("clearing {} bytes at {} of {}", bytes, at, to.bytes()); });
  if (s.profiling) s.profiler.add(zero_name, event);
}

std::size_t Device::memory_now() const { return state_->memory->now; }
std::size_t Device::memory_peak() const { return state_->memory->peak; }
void Device::reset_memory_peak() { state_->memory->peak = state_->memory->now; }

// --- Kernels
// ----------------------------------------------------------------------------------------------------------

const Device::State::Program& Device::State::program(std::string_view file, const Defines& defines,
                                                     Precision precision) {
  if (const auto known = programs.find(KernelKeyView(file, "", defines, precision)); known != programs.end())
    return known->second;
  const BuiltProgram built = builder->build(file, defines, precision);
  return programs
      .emplace(KernelKey{std::string(file), "", defines, precision},
               Program{cl::Program(built.program, false), built.first})
      .first->second;
}

Kernel Device::State::make_kernel(std::string_view file, std::string_view name, const Defines& defines,
                                  Precision precision) {
  const auto& [from, first] = program(file, defines, precision);
  cl_int code = CL_SUCCESS;
  cl::Kernel made(clCreateKernel(from(), std::string(name).c_str(), &code), false);
  if (code == CL_INVALID_KERNEL_NAME)
    throw Error(ErrorKind::Failed, fmt::format("no kernel \"{}\"", name), std::string(file), {},
                "one of " + from.getInfo<CL_PROGRAM_KERNEL_NAMES>());
  check(code, "clCreateKernel", [&] { return fmt::format("kernel {} of {}", name, file); });
  const std::size_t arguments = made.getInfo<CL_KERNEL_NUM_ARGS>();
  Kernel kernel;
  kernel.state_ = std::make_shared<Kernel::State>(Kernel::State{.kernel = std::move(made),
                                                                .name = std::string(name),
                                                                .label = fmt::format("{}:{}", file, name),
                                                                .arguments = arguments,
                                                                .first = first,
                                                                .mark = {variant_of(file, name, defines), precision}});
  return kernel;
}

Kernel Device::kernel(std::string_view file, std::string_view name, const Defines& defines, Precision precision) {
  State& s = *state_;
  if (const auto known = s.kernels.find(KernelKeyView(file, name, defines, precision)); known != s.kernels.end())
    return known->second;
  if (precision == Precision::Double && !s.double_trusted) {
    if (!has_double()) throw Error(ErrorKind::Device, fmt::format("{} has no double precision", s.describe()));
    s.double_trusted = true;  // the probe asks for kernels in double precision too
    if (const std::string fault = remembered_probe_fault(*this, Precision::Double); !fault.empty()) {
      s.double_trusted = false;
      throw Error(ErrorKind::Device, fmt::format("{} computes wrongly in double precision: {}", s.describe(), fault));
    }
  }
  Kernel made = s.make_kernel(file, name, defines, precision);
  return s.kernels.emplace(KernelKey{std::string(file), std::string(name), defines, precision}, std::move(made))
      .first->second;
}

namespace {

using Sizes = std::array<std::size_t, 3>;

/// The local size, halved along its longest side until a group has at most so many work-items.
Sizes at_most(Sizes local, std::size_t items) {
  while (local[0] * local[1] * local[2] > items) {
    std::size_t& longest = *std::ranges::max_element(local);
    longest = (longest + 1) / 2;
  }
  return local;
}

}  // namespace

void Device::launch_with(const Kernel& kernel, const Range& range, const std::vector<Arg>& args) {
  State& s = *state_;
  if (!kernel) throw Error(ErrorKind::Failed, "launching a kernel that was never made");
  Kernel::State& k = *kernel.state_;
  if (args.size() != k.arguments)
    throw Error(ErrorKind::Failed, "wrong number of kernel arguments", k.label, std::to_string(args.size()),
                std::to_string(k.arguments));
  if (std::ranges::count(range.local, 0u) > 0)
    throw Error(ErrorKind::Failed, "local size of zero", k.label, describe_sizes(range.local));
  const std::size_t most = s.found.info.max_group;
  const Sizes local = range.together ? range.local : at_most(range.local, most);
  Sizes global{};
  cl_uint dimensions = 1;
  for (cl_uint d = 0; d < 3; ++d) {
    if (range.global[d] == 0) return;  // nothing to compute
    global[d] = (range.global[d] + local[d] - 1) / local[d] * local[d];
    if (global[d] > 1) dimensions = d + 1;
  }
  const auto launching = [&] {
    return fmt::format("kernel {}, global {}, local {}", k.label, describe_sizes(global), describe_sizes(local));
  };
  // The driver says so too, but knows of no smaller group that is pretended.
  if (local[0] * local[1] * local[2] > most) s.check(CL_INVALID_WORK_GROUP_SIZE, "clEnqueueNDRangeKernel", launching);
  if (std::exchange(k.first, false)) {
    s.builder->add_first_launch(seconds_of(*this, [&] { launch_with(kernel, range, args); }));
    return;
  }
  k.mark.launched();
  for (std::size_t i = 0; i < args.size(); ++i)
    s.check(clSetKernelArg(k.kernel(), static_cast<cl_uint>(i), args[i].size(), args[i].data()), "clSetKernelArg",
            [&] { return fmt::format("argument {} ({} bytes) of kernel {}", i, args[i].size(), k.label); });
  cl_event event = nullptr;
  ++s.launches;
  s.check(clEnqueueNDRangeKernel(s.queue(), k.kernel(), dimensions, nullptr, global.data(), local.data(), 0, nullptr,
                                 s.profiling ? &event : nullptr),
          "clEnqueueNDRangeKernel", launching);
  s.last_launched = &k.label;
  if (s.profiling) s.profiler.add(k.label, event);
  // Some drivers hold work back, and memory with it, until they are told to start.
  if (++s.launches_since_flush >= 64) {
    s.check(clFlush(s.queue()), "clFlush", [&] { return "after kernel " + k.label; });
    s.launches_since_flush = 0;
  }
}

void Device::finish() {
  state_->check(clFinish(state_->queue()), "clFinish", [] { return "waiting for the queue"; });
}

const Tile& Device::tile() {
  if (state_->tile == nullptr) state_->tile = &fastest_tile(*this);
  return *state_->tile;
}

void Device::use_tile(const std::string& name) { state_->tile = name == "auto" ? nullptr : &tile_named(name, "tile"); }

const std::string& Device::gemm() const { return state_->gemm; }

void Device::use_gemm(const std::string& name) { state_->gemm = name; }

// --- Profile
// ----------------------------------------------------------------------------------------------------------

void Device::set_profiling(bool on) {
  if (on == state_->profiling) return;
  finish();
  state_->profiling = on;
  state_->make_queue();
}

std::vector<KernelProfile> Device::profile() {
  finish();
  return state_->profiler.profile();
}

void Device::reset_profile() { state_->profiler.reset(); }

double Device::build_seconds() const { return state_->builder->seconds(); }
int Device::builds() const { return state_->builder->builds(); }

}  // namespace clerestory
