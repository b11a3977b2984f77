// What was read of late, by name.
#pragma once
#include <algorithm>
#include <cstddef>
#include <deque>
#include <string>
#include <utility>

namespace clerestory {

/// Keeps `most` things; the oldest goes first.
template <class T>
class Recent {
 public:
  explicit Recent(std::size_t most) : most_(most) {}

  /// The thing of that name, made by `make`() when it is not kept. Good until the next call.
  template <class Make>
  T& get(const std::string& name, const Make& make) {
    const auto found = std::ranges::find(kept_, name, &std::pair<std::string, T>::first);
    if (found != kept_.end()) return found->second;
    if (kept_.size() == most_) kept_.pop_front();
    return kept_.emplace_back(name, make()).second;
  }

 private:
  std::size_t most_;
  std::deque<std::pair<std::string, T>> kept_;
};

}  // namespace clerestory
