#include "experiments/studies/trained_kinds.hpp"

#include <algorithm>

#include "experiments/studies/light_measures.hpp"
#include "experiments/studies/map_measures.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

/// Throws where ablation.measures has others than those of the kind.
void only_of(const Texts& known, const Config& c, const char* what, const char* kind) {
  Texts others = c.texts("ablation.measures");
  std::erase_if(others, [&](const std::string& measure) { return std::ranges::count(known, measure) > 0; });
  if (!others.empty())
    throw usage_error(what, c.where("ablation.measures"), fmt::format("{}", fmt::join(others, ", ")),
                      fmt::format("at most {} where model.kind = {}", fmt::join(known, ", "), kind));
}

Texts with_measures(const char* first, const Config& c) {
  Texts names = c.texts("ablation.measures");
  names.insert(names.begin(), first);
  return names;
}

class TrainedMaps : public TrainedKind {
 public:
  bool reads_light() const override { return false; }

  void check(const Config& c) const override { only_of(map_measures(), c, "are tables of the light", "maps"); }

  Texts tables(const Config& c) const override { return with_measures("maps", c); }

  RunTables measure(const fs::path& run, const fs::path& test, const Config& c) const override {
    const Texts& frames = c.texts("ablation.frames");
    return measure_maps(run, {test,
                              {frames.begin(), frames.end()},
                              c.text("run.device"),
                              c.text("model.gemm"),
                              c.texts("ablation.measures")});
  }
};

class TrainedLight : public TrainedKind {
 public:
  bool reads_light() const override { return true; }

  void check(const Config& c) const override {
    only_of(light_measures(), c, "are tables of maps", "light");
    if (const std::int64_t scale = c.integer("ablation.judged_scale"); scale != 1)
      throw usage_error("light lies at the pixels of its view", c.where("ablation.judged_scale"),
                        fmt::format("{}", scale), "1 where model.kind = light");
  }

  Texts tables(const Config& c) const override { return with_measures("light", c); }

  RunTables measure(const fs::path& run, const fs::path& test, const Config& c) const override {
    Device device = Device::open(c.text("run.device"));
    device.use_gemm(c.text("model.gemm"));
    return measure_light(run,
                         {test, c.whole("model.width"), c.whole("model.height"), c.flag("ablation.clamped"),
                          c.whole("ablation.spp"), c.texts("ablation.measures")},
                         device);
  }
};

}  // namespace

const TrainedKind& trained_kind(const Config& config) {
  static const TrainedMaps maps;
  static const TrainedLight light;
  const std::string& kind = config.text("model.kind");
  if (kind == "maps") return maps;
  if (kind == "light") return light;
  throw usage_error("no study judges trainings of this", config.where("model.kind"), kind, "maps or light");
}

}  // namespace clerestory
