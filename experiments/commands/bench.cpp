#include "experiments/commands/bench.hpp"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "experiments/bench/conv_bench.hpp"
#include "experiments/bench/light_bench.hpp"
#include "experiments/cli.hpp"

namespace clerestory {
namespace {

struct Family {
  std::string name;
  std::function<nlohmann::ordered_json(Device&, bool quiet)> run;
};

const std::vector<Family>& families() {
  static const std::vector<Family> all{{"conv", bench_conv}, {"light", bench_light}};
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

}  // namespace

void add_bench_command(CommandLine& line) {
  auto names = std::make_shared<std::vector<std::string>>();
  line.add("bench", "Measure kernels beside the device's measured peak")
      .arguments("FAMILY", "families to measure (conv, light); all when none is given", *names)
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes("experiments/peers/conv_torch.py measures PyTorch at the shapes of a --json=FILE.")
      .run([names](const CommonOptions& common) {
        std::vector<const Family*> chosen;
        for (const std::string& name : *names) chosen.push_back(&family(name));
        if (chosen.empty())
          for (const Family& f : families()) chosen.push_back(&f);
        Device device = Device::open(common.device);
        // With the result on stdout there is no room for a table.
        const bool quiet = common.quiet || (common.json && common.json->empty());
        nlohmann::ordered_json results;
        for (const Family* f : chosen) results[f->name] = f->run(device, quiet);
        if (common.json) write_json_result(common, results.dump(1));
      });
}

}  // namespace clerestory
