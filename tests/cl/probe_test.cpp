// The probe refuses a device that computes wrongly, and costs nothing the second time.
#include "host/cl/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;

std::vector<Precision> precisions(const Device& device) {
  return device.has_double() ? std::vector{Precision::Single, Precision::Double} : std::vector{Precision::Single};
}

TEST(Probe, ASoundDevicePasses) {
  Device device = Device::open();
  for (const Precision precision : precisions(device)) EXPECT_EQ(probe_fault(device, precision), "");
}

TEST(Probe, FindsAWrongMatrixProduct) {
  Device device = Device::open();
  for (const Precision precision : precisions(device))
    EXPECT_THAT(probe_fault(device, precision, {{"PROBE_FAULT_PRODUCT", ""}}),
                HasSubstr("matrix product of whole numbers gives"));
}

TEST(Probe, FindsAWrongFunction) {
  Device device = Device::open();
  for (const Precision precision : precisions(device))
    EXPECT_THAT(probe_fault(device, precision, {{"PROBE_FAULT_FUNCTION", ""}}), HasSubstr("log of "));
}

/// The kernels of this program in a folder, with the first `from` in `file` replaced.
void copy_kernels(const ScopedFolder& folder, const std::string& file, const std::string& from, const std::string& to) {
  std::filesystem::copy(std::string(CLERESTORY_SOURCE_DIR) + "/kernels", folder.path(),
                        std::filesystem::copy_options::recursive);
  std::string text = read_text(folder.path() / file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos);
  folder.write(file, text.replace(at, from.size(), to));
}

TEST(Probe, ADeviceThatComputesWronglyIsNotOpened) {
  ScopedFolder cache, kernels;
  copy_kernels(kernels, "tensor/probe.cl", "kernel void probe_product",
               "#define PROBE_FAULT_PRODUCT\nkernel void probe_product");
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string()), folder("CLERESTORY_KERNELS", kernels.string());
  for (int round = 0; round < 2; ++round) {  // the second time from the remembered verdict
    try {
      Device::open();
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Device);
      EXPECT_THAT(error.what(), HasSubstr("refused"));
      EXPECT_THAT(error.what(), HasSubstr("a matrix product of whole numbers gives"));
      EXPECT_THAT(error.what(), HasSubstr(list_devices()[0].name));
    }
  }
}

TEST(Probe, DoublePrecisionThatIsWrongIsRefusedOnItsOwn) {
  ScopedFolder cache, kernels;
  copy_kernels(kernels, "tensor/probe.cl", "kernel void probe_product",
               "#ifdef CLERESTORY_DOUBLE\n#define PROBE_FAULT_PRODUCT\n#endif\nkernel void probe_product");
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string()), folder("CLERESTORY_KERNELS", kernels.string());
  Device device = Device::open();
  EXPECT_NO_THROW(device.kernel("tensor/accumulate.cl", "accumulate"));
  for (int round = 0; round < 2; ++round)
    EXPECT_THAT(message_of<Error>([&] { device.kernel("tensor/accumulate.cl", "accumulate", {}, Precision::Double); }),
                HasSubstr("double precision"));
}

TEST(Probe, TheVerdictIsRemembered) {
  ScopedFolder cache;
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string());
  EXPECT_GT(Device::open().builds(), 0);
  EXPECT_EQ(Device::open().builds(), 0);
  for (const auto& entry : std::filesystem::directory_iterator(cache.path() / "clerestory"))
    std::ofstream(entry.path(), std::ios::binary | std::ios::trunc) << "damaged";
  EXPECT_GT(Device::open().builds(), 0);
  EXPECT_EQ(Device::open().builds(), 0);
}

TEST(Probe, AProbeThatCannotRunRefusesButIsNotRemembered) {
  ScopedFolder cache, kernels;
  copy_kernels(kernels, "tensor/probe.cl", "kernel void probe_product",
               "this does not compile\nkernel void probe_product");
  ScopedVariable cache_home("XDG_CACHE_HOME", cache.string()), folder("CLERESTORY_KERNELS", kernels.string());
  EXPECT_THAT(message_of<Error>([] { Device::open(); }), HasSubstr("clBuildProgram failed"));
  EXPECT_FALSE(std::filesystem::exists(cache.path() / "clerestory"));
}

}  // namespace
}  // namespace clerestory
