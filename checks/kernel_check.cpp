#include "checks/kernel_check.hpp"

#include <algorithm>
#include <cfloat>
#include <regex>

#include "host/error.hpp"

namespace clerestory {
namespace {

using Maker = KernelCheck (*)();

std::vector<Maker>& makers() {
  static std::vector<Maker> all;
  return all;
}

/// Those that a fault names; all where it names none.
std::set<std::string> suspects_of(const std::string& fault, const std::vector<std::string>& kernels) {
  static const std::regex word("[A-Za-z0-9_]+");
  const std::set<std::string> words(std::sregex_token_iterator(fault.begin(), fault.end(), word), {});
  std::set<std::string> named;
  for (const std::string& kernel : kernels)
    if (words.contains(kernel)) named.insert(kernel);
  return named.empty() ? std::set<std::string>(kernels.begin(), kernels.end()) : named;
}

}  // namespace

const std::vector<KernelCheck>& declared_kernel_checks() {
  static const std::vector<KernelCheck> all = [] {
    std::vector<KernelCheck> checks;
    for (const Maker make : makers()) checks.push_back(make());
    return checks;
  }();
  return all;
}

bool declare_kernel_check(KernelCheck (*make)()) {
  makers().push_back(make);
  return true;
}

OpFindings check_kernels(const KernelCheck& check, const CheckedDevices& devices, bool quick) {
  OpFindings findings;
  try {
    const LaunchesSeen seen(findings);
    check.run(devices, findings, quick);
  } catch (const Error& e) {
    findings.faults.push_back(fmt::format("{}: {}", check.stem, e.what()));
  }
  for (const std::string& kernel : check.kernels)
    if (std::ranges::find(findings.launched, kernel, &KernelVariant::name) == findings.launched.end())
      findings.faults.push_back(fmt::format("{} did not launch {}", check.stem, kernel));
  for (const std::string& fault : findings.faults) findings.suspects.merge(suspects_of(fault, check.kernels));
  return findings;
}

void expect_close(OpFindings& findings, const std::string& what, const std::vector<double>& got,
                  const std::vector<double>& want, double roundings) {
  if (got.size() != want.size()) {
    findings.faults.push_back(fmt::format("{}: {} numbers instead of {}", what, got.size(), want.size()));
    return;
  }
  double magnitude = 1e-30, worst = 0;
  std::size_t at = 0;
  for (const double w : want) magnitude = std::max(magnitude, std::abs(w));
  for (std::size_t i = 0; i < want.size(); ++i) {
    if (got[i] == want[i]) continue;
    const double ulps = std::abs(got[i] - want[i]) / (FLT_EPSILON * magnitude);
    if (!(ulps <= worst)) worst = std::isnan(ulps) ? INFINITY : ulps, at = i;
  }
  findings.value_ulps = worse(findings.value_ulps, worst);
  findings.value_error = worse(findings.value_error, worst == 0 ? 0 : worst / roundings);
  if (worst > roundings)
    findings.faults.push_back(
        fmt::format("{}, element {} of {}: {} instead of {}", what, at, want.size(), got[at], want[at]));
}

}  // namespace clerestory
