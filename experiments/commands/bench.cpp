#include "experiments/commands/bench.hpp"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "experiments/bench/conv_bench.hpp"
#include "experiments/bench/gemm_bench.hpp"
#include "experiments/bench/layer_bench.hpp"
#include "experiments/bench/light_bench.hpp"
#include "experiments/bench/nets_bench.hpp"
#include "experiments/bench/peak_bench.hpp"
#include "experiments/bench/ssrt_bench.hpp"
#include "experiments/commands/cli.hpp"
#include "host/cl/tile.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

struct Family {
  std::string name;
  std::function<nlohmann::ordered_json(Device&, const BenchOptions&)> run;
};

const std::vector<Family>& families() {
  static const std::vector<Family> all{{"peak", bench_peak}, {"gemm", bench_gemm},   {"conv", bench_conv},
                                       {"mlp", bench_mlp},   {"light", bench_light}, {"nets", bench_nets},
                                       {"ssrt", bench_ssrt}, {"layer", bench_layer}};
  return all;
}

const Family& family(const std::string& name) {
  const auto found =
      std::find_if(families().begin(), families().end(), [&](const Family& f) { return f.name == name; });
  if (found != families().end()) return *found;
  std::string known;
  for (const Family& f : families()) known += (known.empty() ? "" : ", ") + f.name;
  throw usage_error("no such family of benchmarks", "bench", name, known);
}

/// Throws usage_error for an option that is given and has no say in any of the families.
void refuse_idle(const std::vector<const Family*>& chosen, const char* option, bool given,
                 const std::vector<std::string>& takes) {
  if (given && std::ranges::none_of(chosen, [&](const Family* f) { return std::ranges::count(takes, f->name) > 0; }))
    throw usage_error("has no say here", option, chosen.front()->name, fmt::format("{}", fmt::join(takes, ", ")));
}

/// The tiles that are named: one, the device's own, or all.
std::vector<std::string> tiles_named(Device& device, const std::string& name) {
  if (name == "auto") return {device.tile().name};
  if (name != "all") return {name};
  std::vector<std::string> names;
  for (const Tile& tile : tiles()) names.push_back(tile.name);
  return names;
}

/// SsrtOptions::lanes that are named: one, the device's own (0), or all.
std::vector<int> lanes_named(const std::string& name) {
  if (name == "auto") return {0};
  if (name == "all") return {1, 4, 8, 16};
  return {std::stoi(name)};
}

}  // namespace

void add_bench_command(CommandLine& line) {
  auto names = std::make_shared<std::vector<std::string>>();
  auto tile = std::make_shared<std::string>("auto"), lanes = std::make_shared<std::string>("auto");
  auto options = std::make_shared<BenchOptions>();
  auto without = std::make_shared<bool>(false);
  std::vector<std::string> choices = tile_choices();
  choices.push_back("all");
  line.add("bench", "Measure kernels beside the device's measured peak")
      .arguments("FAMILY",
                 "families to measure (peak, gemm, conv, mlp, light, nets, ssrt, layer); all when none is given",
                 *names)
      .choice("--tile", "Register tile of our kernels; auto: the one in use on this device; all: one after the other",
              *tile, choices)
      .choice("--lanes",
              "ssrt: rays that a work-item takes side by side; auto: as on this device; all: one after the other",
              *lanes, {"auto", "all", "1", "4", "8", "16"})
      .flag("--no-clblast", "Leaves CLBlast out", *without)
      .option(
          "--runs", "N", "timed runs of everything; 0: ten, or as many as fit into a third of a second",
          [options](const std::string& text) {
            read_value(text, "--runs", options->runs);
            if (options->runs < 0) throw usage_error("cannot run that often", "--runs", text, "0 or more");
          },
          "0")
      .option("--only", "TEXT", "conv, nets, ssrt, layer: rows whose name contains this", options->only)
      .option("--write", "FOLDER", "ssrt, layer: what a peer needs to do the same work, as safetensors", options->write)
      .flag("--explain",
            "nets: what each op costs, and what each pass of the compiler did; layer: what each kernel costs",
            options->explain)
      .option(
          "--memory", "MIB",
          "nets: most device memory that a plan may need; values are computed again instead of kept; 0: no limit",
          [options](const std::string& text) {
            int mib = 0;
            read_value(text, "--memory", mib);
            if (mib < 0) throw usage_error("no size of memory", "--memory", text, "0 or more");
            options->memory = static_cast<std::size_t>(mib) << 20;
          },
          "0")
      .common({Common::Device, Common::Gemm, Common::Json, Common::Quiet})
      .notes("experiments/peers measures others beside it: torch_nets.py, torch_layer.py, ssrt_embree.py.")
      .run([names, tile, lanes, options, without](const CommonOptions& common) {
        std::vector<const Family*> chosen;
        for (const std::string& name : *names) chosen.push_back(&family(name));
        if (chosen.empty())
          for (const Family& f : families()) chosen.push_back(&f);
        refuse_idle(chosen, "--only", !options->only.empty(), {"conv", "nets", "ssrt", "layer"});
        refuse_idle(chosen, "--explain", options->explain, {"nets", "layer"});
        refuse_idle(chosen, "--write", !options->write.empty(), {"ssrt", "layer"});
        if (!options->write.empty()) make_directories(options->write);
        Device device = Device::open(common.device);
        device.use_gemm(common.gemm);
        // With the result on stdout there is no room for a table.
        options->quiet = common.quiet || (common.json && common.json->empty());
        options->tiles = tiles_named(device, *tile), options->clblast = !*without;
        if (common.gemm == "direct") options->own = "direct";
        options->lanes = lanes_named(*lanes);
        nlohmann::ordered_json results;
        for (const Family* f : chosen) results[f->name] = f->run(device, *options);
        if (common.json) write_json_result(common, results.dump(1));
      });
}

}  // namespace clerestory
