// The variables of the environment whose names begin in a given way.
#pragma once
#include <unistd.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>

namespace clerestory {

inline std::map<std::string, std::string> environment_with(std::initializer_list<std::string_view> prefixes) {
  std::map<std::string, std::string> found;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view pair = *entry;
    const auto equals = pair.find('=');
    const auto begins = [&](std::string_view prefix) { return pair.starts_with(prefix); };
    if (equals != std::string_view::npos && std::ranges::any_of(prefixes, begins))
      found.emplace(pair.substr(0, equals), pair.substr(equals + 1));
  }
  return found;
}

}  // namespace clerestory
