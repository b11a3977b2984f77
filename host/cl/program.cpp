#include "host/cl/program.hpp"

#include <CL/opencl.hpp>
#include <array>
#include <cstdlib>
#include <mutex>

#include "host/cl/platforms.hpp"
#include "host/cl/pocl_cache.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

// Asking PoCL for a binary makes it compile a generic variant of every kernel in the program; the others keep built
// programs themselves, and a second cache on top of theirs only goes stale.
bool platform_keeps_programs(const std::string& platform) {
  constexpr std::array<std::string_view, 6> keeping = {
      "Portable Computing Language", "NVIDIA CUDA", "Intel(R) OpenCL Graphics",
      "Intel(R) OpenCL HD Graphics", "rusticl",     "Clover"};
  for (const std::string_view name : keeping)
    if (platform.find(name) != std::string::npos) return true;
  return false;
}

bool keep_binaries(const std::string& platform) {
  const char* asked = std::getenv("CLERESTORY_PROGRAM_CACHE");
  const std::string choice = asked == nullptr ? "" : asked;
  if (choice == "on" || choice == "off") return choice == "on";
  if (!choice.empty()) throw usage_error("unknown value", "CLERESTORY_PROGRAM_CACHE", choice, "on or off");
  return !platform_keeps_programs(platform);
}

std::string build_options(const Defines& defines, Precision precision) {
  // Without warnings: clang has some about passing wide vectors on every CPU narrower than them, and PoCL prints their
  // number on the user's terminal.
  std::string options = "-cl-std=CL1.2 -w";
  if (precision == Precision::Double) options += " -DCLERESTORY_DOUBLE";
  for (const auto& [name, value] : defines) options += value.empty() ? " -D" + name : " -D" + name + "=" + value;
  return options;
}

std::mutex g_first;  // guards what follows: threads have devices of their own
FirstBuilds g_first_builds;
std::map<std::string, std::string> g_built;

void note_built(std::string_view file, const std::string& source) {
  const std::string hash = code_hash(source);
  const std::lock_guard guard(g_first);
  g_built[fmt::format("kernels/{}", file)] = hash;
}

void count_first_build(const std::string& device, double seconds) {
  const std::lock_guard guard(g_first);
  g_first_builds.device = device;
  g_first_builds.seconds += seconds;
}

/// The compiler's words, and where to look when it found no mistake: PoCL says no more when it cannot write its files.
std::string log_of(const cl::BuildError& error, bool pocl) {
  std::string log;
  for (const auto& [device, text] : error.getBuildLog()) log += text;
  if (pocl && log.find("error") == std::string::npos)
    log += fmt::format("PoCL compiles in its cache ({}): can everything below it be written, and is there room?",
                       describe(pocl_cache_folder()));
  return log;
}

std::string binary_of(cl_program program) {
  std::size_t size = 0;
  if (clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, nullptr) != CL_SUCCESS) return {};
  std::string binary(size, '\0');
  auto* data = reinterpret_cast<unsigned char*>(binary.data());
  if (clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof data, &data, nullptr) != CL_SUCCESS) return {};
  return binary;
}

}  // namespace

FirstBuilds first_builds() {
  const std::lock_guard guard(g_first);
  return g_first_builds;
}

std::map<std::string, std::string> built_kernels() {
  const std::lock_guard guard(g_first);
  return g_built;
}

ProgramBuilder::ProgramBuilder(cl_context context, cl_device_id device, const DeviceInfo& info,
                               const std::string& fingerprint)
    : context_(context),
      device_(device),
      device_name_(info.name),
      fingerprint_(fingerprint + driver_environment()),
      pocl_(is_pocl(info.platform)),
      driver_keeps_(platform_keeps_programs(info.platform)),
      keep_binaries_(keep_binaries(info.platform)),
      marks_(pocl_ ? pocl_cache_folder().path : std::filesystem::path()) {}

BuiltProgram ProgramBuilder::build(std::string_view file, const Defines& defines, Precision precision) {
  const Stopwatch watch;
  const std::string source = kernel_source(file);
  const std::string options = build_options(defines, precision);
  const std::string key = fingerprint_ + "\n" + options + "\n" + source;
  cl_program program = nullptr;
  bool first = false;
  if (keep_binaries_)
    if (const auto binary = cache_.load("program", key)) program = from_binary(*binary, options);
  if (program == nullptr) {
    program = from_source(source, options, file);
    ++builds_;
    first = !driver_has(key);
    if (keep_binaries_)
      if (const std::string binary = binary_of(program); !binary.empty()) cache_.store("program", key, binary);
  }
  note_built(file, source);
  seconds_ += watch.seconds();
  if (first) count_first_build(device_name_, watch.seconds());
  return {program, first};
}

void ProgramBuilder::add_first_launch(double seconds) {
  seconds_ += seconds;
  count_first_build(device_name_, seconds);
}

// Drivers do not tell whether they took a program from their cache. An empty entry marks what they have built once; in
// PoCL's cache where that is known, so that it goes with it.
bool ProgramBuilder::driver_has(const std::string& key) const {
  if (!driver_keeps_) return false;
  const std::string short_key = fmt::format("{:016x}", hash_text(key));
  if (marks_.load("built", short_key)) return true;
  marks_.store("built", short_key, "");
  return false;
}

cl_program ProgramBuilder::from_source(const std::string& source, const std::string& options, std::string_view file) {
  try {
    cl::Program program(cl::Context(context_, true), source);
    const cl::Device device(device_, true);
    program.build({device}, options.c_str());
    cl_program built = program();
    clRetainProgram(built);
    return built;
  } catch (const cl::BuildError& error) {
    throw Error(ErrorKind::Device,
                fmt::format("{} failed with {} for \"{}\" with options \"{}\" on {}:\n{}", error.what(),
                            opencl_error_name(error.err()), file, options, device_name_, log_of(error, pocl_)));
  } catch (const cl::Error& error) {
    throw Error(ErrorKind::Device, fmt::format("{} failed with {} for \"{}\" with options \"{}\" on {}", error.what(),
                                               opencl_error_name(error.err()), file, options, device_name_));
  }
}

// A binary that the driver does not take, after an update say, is no error: the source is built instead.
cl_program ProgramBuilder::from_binary(const std::string& binary, const std::string& options) {
  const std::size_t size = binary.size();
  const auto* data = reinterpret_cast<const unsigned char*>(binary.data());
  cl_int status = 0, error = 0;
  cl_program program = clCreateProgramWithBinary(context_, 1, &device_, &size, &data, &status, &error);
  if (error != CL_SUCCESS) return nullptr;
  if (status == CL_SUCCESS && clBuildProgram(program, 1, &device_, options.c_str(), nullptr, nullptr) == CL_SUCCESS)
    return program;
  clReleaseProgram(program);
  return nullptr;
}

}  // namespace clerestory
