#include "host/cl/kernel_variant.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>

#include "host/cl/launch_mark.hpp"

namespace clerestory {
namespace {

std::atomic<long> g_round = 0;
std::mutex g_guard;  // of what follows: threads have devices of their own
std::map<Precision, std::set<KernelVariant>> g_launched;

/// In one write, so that processes can share the file and a driver that crashes leaves the name of the kernel there.
void list_launch(const KernelVariant& variant) {
  const char* file = std::getenv("CLERESTORY_LAUNCHES");
  if (file == nullptr || *file == '\0') return;
  const std::string line = text_of(variant) + "\n";
  const int descriptor = ::open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = descriptor >= 0 && ::write(descriptor, line.data(), line.size()) == std::ssize(line);
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!written) throw usage_error(std::strerror(error), "CLERESTORY_LAUNCHES", file, "a file that can be written");
}

}  // namespace

KernelVariant variant_of(std::string_view file, std::string_view name, Defines defines) {
  defines.erase("GROUP_RAYS");
  return {std::string(file), std::string(name), std::move(defines)};
}

std::string text_of(const KernelVariant& variant) {
  std::string text = variant.file + ":" + variant.name;
  for (const auto& [name, value] : variant.defines) text += value.empty() ? " " + name : " " + name + "=" + value;
  return text;
}

void LaunchMark::launched() {
  const long round = g_round;
  if (std::exchange(seen, round) == round) return;
  list_launch(variant);
  const std::lock_guard guard(g_guard);
  g_launched[precision].insert(variant);
}

std::set<KernelVariant> launched_variants(Precision precision) {
  const std::lock_guard guard(g_guard);
  return g_launched[precision];
}

void forget_launched() {
  const std::lock_guard guard(g_guard);
  ++g_round;
  g_launched.clear();
}

}  // namespace clerestory
