// Every kernel of the ops is launched by a declared case in both precisions (check_op demands that of each case's
// list), every case has a reference, and a gradient or a reason for having none.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "checks/op_case.hpp"
#include "host/cl/device.hpp"

namespace clerestory {
namespace {

/// Kernels of other rooms that live beside the ops, and where their tests are.
const std::map<std::string, std::string> kElsewhere{
    {"tensor/place.cl", "map_chunks: tests/graph"},
    {"tensor/probe.cl", "the check of a device when it is opened: tests/cl"},
    {"tensor/tile.cl", "measures the register tiles: tests/cl"},
    {"tensor/ceilings.cl", "measures the machine: tests/cl"},
};

/// kernel name -> file, over all sources under tensor, nn, light and shade.
std::multimap<std::string, std::string> all_kernels() {
  static const std::regex declaration(R"(kernel\s+(?:__attribute__\s*\(\([^)]*\)+\s*)?void\s+(\w+)\s*\()");
  std::multimap<std::string, std::string> kernels;
  for (const std::string& file : kernel_files()) {
    const std::string room = file.substr(0, file.find('/'));
    if (room != "tensor" && room != "nn" && room != "light" && room != "shade") continue;
    if (!file.ends_with(".cl") || kElsewhere.count(file)) continue;
    const std::string source = kernel_source(file);
    long found = 0;
    for (std::sregex_iterator it(source.begin(), source.end(), declaration), end; it != end; ++it, ++found)
      kernels.emplace((*it)[1], file);
    EXPECT_GT(found, 0) << file << " has no kernel that this test can read";
  }
  return kernels;
}

TEST(Registry, EveryKernelHasACase) {
  std::set<std::string> covered;
  for (const OpCase& c : declared_cases()) covered.insert(c.kernels.begin(), c.kernels.end());
  const auto kernels = all_kernels();
  ASSERT_FALSE(kernels.empty());
  for (const auto& [kernel, file] : kernels) {
    EXPECT_TRUE(covered.count(kernel)) << "no OpCase names kernel " << kernel << " of " << file;
    EXPECT_EQ(kernels.count(kernel), 1u) << kernel << " is a kernel of two files; profiles go by name";
  }
  for (const std::string& kernel : covered)
    EXPECT_TRUE(kernels.count(kernel)) << "a case names " << kernel << ", which is no kernel";
}

TEST(Registry, EveryCaseIsComplete) {
  ASSERT_FALSE(declared_cases().empty());
  std::set<std::string> names;
  for (const OpCase& c : declared_cases()) {
    const std::string name = c.stem + "/" + c.label;
    EXPECT_TRUE(names.insert(name).second) << name << " is declared twice";
    EXPECT_TRUE(c.reference) << name << " has no reference";
    EXPECT_FALSE(c.kernels.empty()) << name << " launches no kernel";
    EXPECT_NE(c.differentiate.empty(), c.no_gradient.empty())
        << name << ": either inputs to differentiate, or the reason for none";
  }
}

/// The case's nodes, once more.
std::deque<Node> const& built(const OpCase& c, Graph& graph, Values& values, std::vector<Value>& outputs) {
  for (const auto& [name, tensor] : c.inputs) values[name] = graph.input(name, tensor.shape, tensor.type());
  outputs = c.build(graph, values);
  for (const auto& [name, tensor] : c.states) values[name] = graph.state(name, tensor.shape, Init::fixed(0));
  return graph.nodes();
}

// An op without any rule does not compile (Op::adjoint is pure). What it says of each input and output is what its rule
// gives: a gradient where there is a slope, of the input's shape, and none elsewhere.
TEST(Registry, EveryOpDeclaresItsAdjointOrThatItHasNone) {
  for (const OpCase& c : declared_cases()) {
    Graph graph;
    Values values;
    std::vector<Value> outputs;
    const std::size_t count = built(c, graph, values, outputs).size();
    for (std::size_t id = 0; id < count; ++id) {
      const Node& node = graph.nodes()[id];
      const std::string name = c.stem + "/" + c.label + ": " + node.op->name();
      const auto slopes = [&](std::size_t i) {
        std::vector<bool> of_input;
        for (std::size_t o = 0; o < node.outputs.size(); ++o)
          of_input.push_back(node.op->slope(static_cast<int>(i), static_cast<int>(o)) == Slope::Adjoint);
        return of_input;
      };
      std::vector<Value> arriving(node.outputs.size());
      for (std::size_t i = 0; i < node.inputs.size(); ++i)
        for (std::size_t o = 0; const bool slope : slopes(i)) {
          if (slope) {
            EXPECT_EQ(node.outputs[o].type, Type::Real) << name << ": integers have no gradient";
            arriving[o] = graph.fill(node.outputs[o].shape, 1);
          }
          ++o;
        }
      if (std::ranges::none_of(arriving, [](const Value& v) { return static_cast<bool>(v); })) continue;
      const std::vector<Value> leaving = node.op->adjoint(node, arriving);
      ASSERT_EQ(leaving.size(), node.inputs.size()) << name;
      for (std::size_t i = 0; i < leaving.size(); ++i) {
        const std::vector<bool> slope = slopes(i);
        const bool declared = std::ranges::find(slope, true) != slope.end();
        EXPECT_EQ(static_cast<bool>(leaving[i]), declared) << name << ": input " << i;
        if (!leaving[i]) continue;
        EXPECT_EQ(leaving[i].shape().text(), node.in_shape(static_cast<int>(i)).text()) << name << ": input " << i;
      }
    }
  }
}

// Where a case gives a reason for no gradient, nobody is given one by mistake.
TEST(Registry, WhatACaseDoesNotDifferentiateIsRefusedOrDetached) {
  int refused = 0;
  for (const OpCase& c : declared_cases()) {
    if (c.no_gradient.empty() || c.states.size() > 0) continue;
    Graph graph;
    Values values;
    std::vector<Value> outputs, seeds;
    built(c, graph, values, outputs);
    std::erase_if(outputs, [](const Value& v) { return v.type() == Type::Int; });
    if (outputs.empty()) continue;
    for (const Value& v : outputs) seeds.push_back(graph.fill(v.shape(), 1));
    for (const auto& [name, value] : values) {
      if (value.type() == Type::Int) continue;
      try {
        gradient(outputs, seeds, std::array{value});
      } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("no gradient reaches"), std::string::npos) << e.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 20);
}

TEST(Registry, EveryOpHasACase) {
  std::set<std::string> stems;
  for (const OpCase& c : declared_cases()) stems.insert(c.stem);
  const std::filesystem::path ops = std::filesystem::path(CLERESTORY_SOURCE_DIR) / "host/ops";
  int seen = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(ops)) {
    if (entry.path().extension() != ".cpp") continue;
    // A header without a kernel of its stem is a helper of ops, not an op.
    const std::string stem = entry.path().stem().string();
    const std::filesystem::path room = entry.path().parent_path().filename();
    const std::filesystem::path kernel =
        std::filesystem::path(CLERESTORY_SOURCE_DIR) / "kernels" / room / (stem + ".cl");
    if (!std::filesystem::exists(kernel)) continue;
    EXPECT_TRUE(stems.count(stem)) << "op " << entry.path() << " has no OpCase";
    ++seen;
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
}  // namespace clerestory
