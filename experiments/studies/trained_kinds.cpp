#include "experiments/studies/trained_kinds.hpp"

#include "experiments/studies/light_measures.hpp"
#include "experiments/studies/map_measures.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

class TrainedMaps : public TrainedKind {
 public:
  bool reads_light() const override { return false; }

  void check(const Config& c) const override {
    if (const Texts& measures = c.texts("ablation.measures"); !measures.empty())
      throw usage_error("are tables of the light", c.origin("ablation.measures") + ": ablation.measures",
                        fmt::format("{}", fmt::join(measures, ", ")), "none where model.kind = maps");
  }

  Texts tables(const Config&) const override { return {"maps"}; }

  RunTables measure(const fs::path& run, const fs::path& test, const Config& c) const override {
    const Texts& frames = c.texts("ablation.frames");
    return measure_maps(run, {test, {frames.begin(), frames.end()}, c.text("run.device"), c.text("model.gemm")});
  }
};

class TrainedLight : public TrainedKind {
 public:
  bool reads_light() const override { return true; }
  void check(const Config&) const override {}

  Texts tables(const Config& c) const override {
    Texts names = c.texts("ablation.measures");
    names.insert(names.begin(), "light");
    return names;
  }

  RunTables measure(const fs::path& run, const fs::path& test, const Config& c) const override {
    Device device = Device::open(c.text("run.device"));
    device.use_gemm(c.text("model.gemm"));
    const auto whole = [&](const char* key) { return static_cast<int>(c.integer(key)); };
    return measure_light(run,
                         {test, whole("model.width"), whole("model.height"), c.flag("ablation.clamped"),
                          whole("ablation.spp"), c.texts("ablation.measures")},
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
  throw usage_error("no study judges trainings of this", config.origin("model.kind") + ": model.kind", kind,
                    "maps or light");
}

}  // namespace clerestory
