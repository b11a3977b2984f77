// Building programs, with built ones kept on disk where the driver does not do so itself. Private to host/cl.
#pragma once
#include <string>
#include <string_view>

#include "host/cl/device.hpp"
#include "host/cl/disk_cache.hpp"

typedef struct _cl_context* cl_context;
typedef struct _cl_device_id* cl_device_id;
typedef struct _cl_program* cl_program;

namespace clerestory {

/// kernel_hash() of a source whose includes are in it. Beside kernel_source().
std::string code_hash(const std::string& source);

struct BuiltProgram {
  cl_program program;  // owned by who asked for it
  bool first;          // neither this cache nor, as far as is remembered, the driver's had it
};

class ProgramBuilder {
 public:
  /// Built programs are kept on disk when CLERESTORY_PROGRAM_CACHE is "on", never when it is "off", and by default on
  /// platforms that are not known to keep them themselves.
  ProgramBuilder(cl_context context, cl_device_id device, const DeviceInfo& info, const std::string& fingerprint);

  /// Throws ErrorKind::Device with the compiler's log.
  BuiltProgram build(std::string_view file, const Defines& defines, Precision precision);

  /// Counts the first launch of a kernel whose program was built for the first time: some drivers compile in it.
  void add_first_launch(double seconds);

  double seconds() const { return seconds_; }
  int builds() const { return builds_; }  // from source

 private:
  bool driver_has(const std::string& key) const;
  cl_program from_source(const std::string& source, const std::string& options, std::string_view file);
  cl_program from_binary(const std::string& binary, const std::string& options);

  cl_context context_;
  cl_device_id device_;
  std::string device_name_, fingerprint_;
  bool pocl_ = false, driver_keeps_ = false, keep_binaries_ = false;
  DiskCache cache_;
  DiskCache marks_;  // of programs that the driver keeps
  double seconds_ = 0;
  int builds_ = 0;
};

}  // namespace clerestory
