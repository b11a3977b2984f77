#include "host/cl/pretend.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <sstream>

namespace clerestory {
namespace {

constexpr const char* kVariable = "CLERESTORY_PRETEND";

std::size_t number_of(const std::string& word, std::size_t equals) {
  const char *first = word.data() + equals + 1, *last = word.data() + word.size();
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(first, last, number);
  if (equals == std::string::npos || error != std::errc() || end != last)
    throw usage_error("no number of what a device is to have less of", kVariable, word, "such as max_group=64");
  return number;
}

void take(FoundDevice& device, const std::string& word) {
  DeviceInfo& info = device.info;
  const std::size_t equals = word.find('=');
  const std::string name = word.substr(0, equals);
  const auto at_most = [&](std::size_t& has, std::size_t unit) { has = std::min(has, number_of(word, equals) * unit); };
  constexpr std::size_t kKib = 1 << 10, kMib = 1 << 20;
  if (word == "no_fp64")
    info.fp64 = false;
  else if (word == "no_unified_memory")
    info.unified_memory = false;
  else if (name == "max_group")
    at_most(info.max_group, 1);
  else if (name == "max_allocation")
    at_most(info.max_allocation, kMib);
  else if (name == "memory")
    at_most(info.memory, kMib);
  else if (name == "local_memory")
    at_most(info.local_memory, kKib);
  else if (name == "lost_after")
    device.lost_after = number_of(word, equals);
  else
    throw usage_error("nothing that a device can be without", kVariable, word,
                      "no_fp64, no_unified_memory, max_group=ITEMS, max_allocation=MIB, memory=MIB, local_memory=KIB "
                      "or lost_after=LAUNCHES");
}

}  // namespace

void pretend(FoundDevice& device) {
  const char* less = std::getenv(kVariable);
  std::istringstream words(less != nullptr ? less : "");
  for (std::string word; std::getline(words, word, ',');) take(device, word);
}

}  // namespace clerestory
