#include "experiments/commands/weights.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/network.hpp"
#include "experiments/training/report.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

struct WeightsArguments {
  std::filesystem::path file, out;
};

void inspect(const WeightsArguments& arguments, const CommonOptions& common) {
  const TensorFile file = read_safetensors(arguments.file);
  std::size_t numbers = 0;
  nlohmann::ordered_json out;
  std::string text;
  for (const auto& [key, value] : file.metadata) {
    out["metadata"][key] = value;
    if (key != "history") text += fmt::format("{}: {}\n", key, value);
  }
  text += "\n";
  for (const auto& [name, tensor] : file.tensors) {
    numbers += tensor.count();
    out["tensors"][name] = tensor.shape;
    text += fmt::format("{:<60} {}\n", name, fmt::join(tensor.shape, "x"));
  }
  out["numbers"] = numbers;
  text += fmt::format("\n{} tensors, {} numbers, {} bytes\n", file.tensors.size(), numbers,
                      std::filesystem::file_size(arguments.file));
  if (!common.json || !common.json->empty()) std::fputs(text.c_str(), stdout);
  write_json_result(common, out.dump(1));
}

void export_weights(const WeightsArguments& arguments, const CommonOptions& common) {
  const LoadedWeights loaded = load_weights(arguments.file, Device::open(common.device));
  if (loaded.history.legs.empty()) throw usage_error("the file says nothing of its training", arguments.file.string());
  const std::filesystem::path folder = arguments.out.has_parent_path() ? arguments.out.parent_path() : ".";
  make_directories(folder);
  const Leg& last = loaded.history.legs.back();
  write_weights(arguments.out, *loaded.states, loaded.history, loaded.means,
                {loaded.preset, net_text(loaded.net), loaded.size, last.commit, inference_states(loaded.net)});
  write_model_card(arguments.out, loaded.history, folder, "CARD.md");
  std::printf("%s\n%s\n", arguments.out.c_str(), (folder / "CARD.md").c_str());
}

}  // namespace

void add_weights_commands(CommandLine& line) {
  auto arguments = std::make_shared<WeightsArguments>();
  line.describe_group("weights", "Weights and checkpoints of the nets");
  line.add("weights inspect", "What a file holds: metadata, and each tensor with its shape")
      .argument("FILE", "Weights or checkpoint (.safetensors)", arguments->file)
      .common({Common::Json})
      .run([arguments](const CommonOptions& common) { inspect(*arguments, common); });
  line.add("weights export", "Weights for inference in half precision, with CARD.md and validation.svg beside them")
      .argument("FILE", "Checkpoint or weights of `clerestory train`", arguments->file)
      .argument("OUT", "File to write, such as nets/weights/maps.safetensors", arguments->out)
      .common({Common::Device})
      .run([arguments](const CommonOptions& common) { export_weights(*arguments, common); });
}

}  // namespace clerestory
