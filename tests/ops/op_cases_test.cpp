// Every declared case is a test of its own: "Op.<stem>/<label>" on the bodies that suit the device, "OpInGroups",
// "OpInTiles" and "OpByProducts" on the others that its kernels have; "Kernels.<stem>" checks kernels that are no op's.
#include <gtest/gtest.h>

#include "checks/kernel_check.hpp"
#include "checks/op_check.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

class OpTest : public testing::Test {
 public:
  OpTest(const OpCase& op_case, Bodies bodies) : case_(op_case), bodies_(bodies) {}
  void TestBody() override {
    for (const std::string& fault : check_op(case_, test_devices(), bodies_).faults) ADD_FAILURE() << fault;
  }

 private:
  const OpCase& case_;
  Bodies bodies_;
};

class KernelsTest : public testing::Test {
 public:
  explicit KernelsTest(const KernelCheck& check) : check_(check) {}
  void TestBody() override {
    for (const std::string& fault : check_kernels(check_, test_devices()).faults) ADD_FAILURE() << fault;
  }

 private:
  const KernelCheck& check_;
};

const char* suite(Bodies bodies) {
  switch (bodies) {
    case Bodies::InGroups:
      return "OpInGroups";
    case Bodies::InTiles:
      return "OpInTiles";
    case Bodies::ByProducts:
      return "OpByProducts";
    default:
      return "Op";
  }
}

void register_cases() {
  for (const OpCase& c : declared_cases())
    for (const Bodies bodies : c.in_tests ? bodies_of(c) : std::vector<Bodies>{})
      testing::RegisterTest(suite(bodies), c.name().c_str(), nullptr, nullptr, __FILE__, __LINE__,
                            [&c, bodies]() -> testing::Test* { return new OpTest(c, bodies); });
  for (const KernelCheck& c : declared_kernel_checks())
    testing::RegisterTest("Kernels", c.stem.c_str(), nullptr, nullptr, __FILE__, __LINE__,
                          [&c]() -> testing::Test* { return new KernelsTest(c); });
}

}  // namespace
}  // namespace clerestory

// In place of gtest's own: while files are still being initialised, not every case is declared.
int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  clerestory::register_cases();
  return RUN_ALL_TESTS();
}
