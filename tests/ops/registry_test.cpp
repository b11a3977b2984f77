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

namespace fs = std::filesystem;
const fs::path kSource = CLERESTORY_SOURCE_DIR;

/// Kernels that are no op's, and where their tests are.
const std::map<std::string, std::string> kElsewhere{
    {"tensor/place.cl", "tests/ops/tensor/place_test.cpp"},         // of map_chunks
    {"tensor/probe.cl", "tests/cl/probe_test.cpp"},                 // asked when a device is opened
    {"tensor/tile.cl", "tests/cl/tile_test.cpp"},                   // measures the register tiles
    {"tensor/ceilings.cl", "tests/cl/ceilings_test.cpp"},           // measures the machine
    {"trace/path.cl", "tests/tracer/path_test.cpp"},                // the path tracer
    {"trace/objects.cl", "tests/tracer/objects_test.cpp"},          // rays to meshes that are put in
    {"trace/scene_probe.cl", "tests/tracer/light_test.cpp"},        // lets tests call the functions of trace
    {"lib/surface_probe.cl", "tests/ops/shade/surface_probe.cpp"},  // lets tests call those of lib
};

/// Backends and parts of one op: the stem that they are checked under.
const std::map<std::string, std::string> kPartOf{
    {"nn/conv_cpu.cl", "nn/conv"},      {"nn/conv_gpu.cl", "nn/conv"}, {"nn/conv_pack.cl", "nn/conv"},
    {"nn/conv_winograd.cl", "nn/conv"}, {"nn/im2col.cl", "nn/conv"},   {"light/net_products.cl", "light/ask_mlp"}};

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
  for (const OpCase& c : declared_cases()) {
    covered.insert(c.kernels.begin(), c.kernels.end());
    covered.insert(c.product_kernels.begin(), c.product_kernels.end());
  }
  const auto kernels = all_kernels();
  ASSERT_FALSE(kernels.empty());
  for (const auto& [kernel, file] : kernels) {
    EXPECT_TRUE(covered.count(kernel)) << "no OpCase names kernel " << kernel << " of " << file;
    EXPECT_EQ(kernels.count(kernel), 1u) << kernel << " is a kernel of two files; profiles go by name";
  }
  for (const std::string& kernel : covered)
    EXPECT_TRUE(kernels.count(kernel)) << "a case names " << kernel << ", which is no kernel";
}

// One stem: what is in kernels/light/ssrt.cl is checked in checks/light/ssrt.cpp or tests/ops/light/ssrt_test.cpp.
TEST(Registry, EveryKernelFileIsTestedUnderItsStem) {
  int seen = 0;
  for (const std::string& file : kernel_files()) {
    if (!file.ends_with(".cl")) continue;
    ++seen;
    if (const auto elsewhere = kElsewhere.find(file); elsewhere != kElsewhere.end()) {
      EXPECT_TRUE(fs::exists(kSource / elsewhere->second)) << file << " has lost its test, " << elsewhere->second;
      continue;
    }
    const auto part = kPartOf.find(file);
    const std::string stem = part != kPartOf.end() ? part->second : file.substr(0, file.size() - 3);
    EXPECT_TRUE(fs::exists(kSource / "checks" / (stem + ".cpp")) ||
                fs::exists(kSource / "tests/ops" / (stem + "_test.cpp")))
        << file << " has neither checks/" << stem << ".cpp nor tests/ops/" << stem << "_test.cpp";
  }
  EXPECT_GT(seen, 40);
  for (const auto& exceptions : {kElsewhere, kPartOf})
    for (const auto& [file, why] : exceptions)
      EXPECT_TRUE(std::ranges::count(kernel_files(), file)) << file << " is gone and needs no exception";
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
  int asked = 0;
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
      ++asked;
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
  EXPECT_GT(asked, 40) << "as many as there are files of kernels";
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
  int seen = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kSource / "host/ops")) {
    if (entry.path().extension() != ".cpp") continue;
    // A header without a kernel of its stem is a helper of ops, not an op.
    const std::string stem = entry.path().stem().string();
    const fs::path room = entry.path().parent_path().filename();
    if (!fs::exists(kSource / "kernels" / room / (stem + ".cl"))) continue;
    EXPECT_TRUE(stems.count(stem)) << "op " << entry.path() << " has no OpCase";
    ++seen;
  }
  EXPECT_GT(seen, 30);
}

}  // namespace
}  // namespace clerestory
