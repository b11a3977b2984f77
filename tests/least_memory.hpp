// The smallest budget that compile() says a plan can keep to.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "host/graph/plan.hpp"
#include "tests/message_of.hpp"

namespace clerestory {

/// Bytes, as the error for a budget of one byte names them.
inline std::size_t least_memory(const Graph& graph, const std::vector<Value>& outputs, const Device& device,
                                bool updates, PlanOptions options = {}) {
  options.budget = 1;
  const std::string said = message_of<Error>([&] { compile(graph, outputs, device, options, updates); });
  const std::size_t at = said.find("at least ");
  EXPECT_NE(at, std::string::npos) << said;
  return at == std::string::npos ? 0 : static_cast<std::size_t>(std::stod(said.substr(at + 9)) * 0x1p20);
}

}  // namespace clerestory
