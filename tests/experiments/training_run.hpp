// Whole runs of `clerestory train` with a tiny net on tiny data.
#pragma once
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "experiments/training/schema.hpp"
#include "experiments/training/trainer.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {

/// Of a net that trains in a second.
inline const std::vector<std::string> tiny_net{
    "model.growth=4",           "model.first=16",         "model.layers=[1,1,1,1]", "model.decoder=[32,16,16,8,4]",
    "model.width=32",           "model.height=32",        "train.batch=2",          "log.every=3",
    "log.checkpoint_minutes=0", "data.validation_views=2"};

/// Changes the bytes of a file.
inline void rewrite(const std::filesystem::path& path, const std::function<void(std::string&)>& change) {
  std::string bytes = text_of(path);
  change(bytes);
  std::ofstream(path, std::ios::binary) << bytes;
}

struct TrainingRun : testing::Test {
  ScratchFolder folder{"clerestory-training-run"};

  void SetUp() override {
    set_quiet(true);
    write_synthetic_rooms(folder / "data", "train", 2, 4, 32, 32, 5);
    write_synthetic_rooms(folder / "data", "val", 1, 3, 32, 32, 6);
    std::ofstream(folder / "tiny.toml") << "[data]\ntrain = [\"" << (folder / "data").string() << "\"]\n";
  }
  void TearDown() override { set_quiet(false); }

  std::vector<std::string> overrides(const std::string& root, std::vector<std::string> more) const {
    std::vector<std::string> all = tiny_net;
    all.push_back("run.root=" + (folder / root).string());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Config config(const std::string& root, const std::vector<std::string>& more) const {
    return load_config(folder / "tiny.toml", training_schema(), overrides(root, more));
  }
  TrainingOutcome run(const std::string& root, const std::vector<std::string>& more) const {
    return train(config(root, more), {"clerestory", "train"});
  }
  Program start(const std::string& root, const std::vector<std::string>& more, const Surroundings& around = {}) const {
    std::vector<std::string> arguments{"train", (folder / "tiny.toml").string()};
    for (const std::string& o : overrides(root, more)) arguments.push_back(o);
    return Program(arguments, folder / (root + ".txt"), around);
  }
  std::string output_of(const std::string& root) const { return text_of(folder / (root + ".txt")); }
  /// The only run below a root.
  std::filesystem::path run_below(const std::string& root) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder / root / "train")) return entry.path();
    return {};
  }
};

}  // namespace clerestory
