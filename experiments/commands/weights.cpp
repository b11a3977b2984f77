#include "experiments/commands/weights.hpp"

#include <cstdio>

#include "experiments/training/report.hpp"
#include "experiments/weights/average.hpp"
#include "experiments/weights/imported.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/io/json_file.hpp"
#include "host/report/progress.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

struct WeightsArguments {
  std::filesystem::path file, picture, out;
  std::vector<std::string> files;
  std::optional<double> gain;
};

/// What is read is looked for among the data that come with the program, too.
WeightsArguments with_found_paths(WeightsArguments arguments) {
  for (std::filesystem::path* path : {&arguments.file, &arguments.picture})
    if (!path->empty()) *path = found_data(*path);
  for (std::string& file : arguments.files) file = found_data(file).string();
  return arguments;
}

void inspect(const WeightsArguments& arguments, const CommonOptions& common) {
  const TensorFile file = read_safetensors(arguments.file);
  std::size_t numbers = 0;
  nlohmann::ordered_json out;
  std::string text, not_finite_text;
  for (const auto& [key, value] : file.metadata) {
    out["metadata"][key] = value;
    if (key != "history") text += fmt::format("{}: {}\n", key, value);
  }
  text += "\n";
  for (const auto& [name, tensor] : file.tensors) {
    numbers += tensor.count();
    out["tensors"][name] = tensor.shape;
    text += fmt::format("{:<60} {}\n", name, fmt::join(tensor.shape, "x"));
    if (const std::string found = not_finite(tensor); !found.empty()) {
      out["not_finite"][name] = found;
      not_finite_text += fmt::format("tensor {}: a value is not finite: {}\n", name, found);
    }
  }
  out["numbers"] = numbers;
  out["checksums"] = file.checksummed;
  text += fmt::format("\n{} tensors, {} numbers, {} bytes\n", file.tensors.size(), numbers,
                      std::filesystem::file_size(arguments.file));
  text += file.checksummed ? "checksums agree\n" : "no checksums: damage to this file would not be found\n";
  text += not_finite_text;
  if (!common.json || !common.json->empty()) std::fputs(terminal_text(text).c_str(), stdout);
  write_json_result(common, out.dump(1));
}

void write_maps(const std::filesystem::path& out, const LoadedWeights& weights, const Moments& moments) {
  write_weights(out, *weights.states, weights.history, weights.means,
                {weights.preset, net_text(weights.net), weights.size, weights.history.legs.back().commit,
                 maps_states(weights.net), moments});
}

void export_maps(const WeightsArguments& arguments, Device device) {
  if (arguments.gain)
    throw usage_error("a gain is of the light out of view, and these are weights of maps", "--gain",
                      fmt::format("{}", *arguments.gain), "none");
  const LoadedWeights loaded = load_weights(arguments.file, std::move(device));
  if (loaded.history.legs.empty()) throw usage_error("the file says nothing of its training", arguments.file.string());
  const std::filesystem::path folder = arguments.out.has_parent_path() ? arguments.out.parent_path() : ".";
  make_directories(folder);
  check_weights_folder(folder, {arguments.out});
  write_maps(arguments.out, loaded, read_moments(arguments.file));
  std::printf("%s\n%s\n", arguments.out.c_str(), write_folder_card(folder, arguments.out).c_str());
}

double gain_of(const WeightsArguments& arguments, const LightSizes& net) {
  if (!arguments.gain) return net.out_of_view.gain;
  const std::string said = fmt::format("{}", *arguments.gain);
  if (net.li2020) throw usage_error("the light of Li et al. has no part out of view", "--gain", said, "none");
  if (!(*arguments.gain > 0 && *arguments.gain <= kMostGain))
    throw usage_error("the light out of view cannot be multiplied by that", "--gain", said,
                      fmt::format("above 0, at most {:g}", kMostGain));
  return *arguments.gain;
}

void export_light(const WeightsArguments& arguments, Device device) {
  if (arguments.out.extension() == ".safetensors")
    throw usage_error("the light's weights are two files, and OUT the folder for both", "OUT", arguments.out.string(),
                      "a folder such as nets/weights");
  const LoadedLight loaded = load_light(arguments.file, std::move(device));
  const double gain = gain_of(arguments, loaded.net);
  make_directories(arguments.out);
  check_weights_folder(arguments.out, weights_files(arguments.out));
  write_light(arguments.out, *loaded.states, loaded.history,
              {loaded.preset, light_text(loaded.net), loaded.size, loaded.history.legs.back().commit,
               light_states(loaded.net), read_moments(arguments.file), gain});
  for (const std::filesystem::path& file : weights_files(arguments.out)) std::printf("%s\n", file.c_str());
  std::printf("%s\n", write_folder_card(arguments.out, arguments.out / "maps.safetensors").c_str());
}

void export_weights(const WeightsArguments& arguments, const CommonOptions& common) {
  const bool light = read_history(weights_files(arguments.file)[0]).kind() == "light";
  (light ? export_light : export_maps)(arguments, Device::open(common.device));
}

void average(const WeightsArguments& arguments, const CommonOptions& common) {
  if (std::filesystem::exists(arguments.out))
    throw usage_error("is there already", "OUT", arguments.out.string(), "a new file");
  const std::vector<std::filesystem::path> files(arguments.files.begin(), arguments.files.end());
  const LoadedWeights mean = average_weights(files, Device::open(common.device));
  if (arguments.out.has_parent_path()) make_directories(arguments.out.parent_path());
  write_maps(arguments.out, mean, read_moments(files.back()));
  std::printf("%s\n", arguments.out.c_str());
}

/// Nothing is replaced but what an import wrote before.
void import_weights(const WeightsArguments& arguments, const CommonOptions& common) {
  if (std::filesystem::exists(arguments.out) && !is_imported(arguments.out))
    throw usage_error("is there already, and no import wrote it", arguments.out.string(), "", "another name");
  const ImportedNet imported = import_net(arguments.file);
  if (arguments.out.has_parent_path()) make_directories(arguments.out.parent_path());
  write_safetensors(arguments.out, imported.file);
  std::size_t numbers = 0;
  for (const auto& [name, tensor] : imported.file.tensors) numbers += tensor.count();
  say(fmt::format("{}: {} tensors, {} numbers; left out: {}", imported.net, imported.file.tensors.size(), numbers,
                  imported.left_out.empty() ? "nothing" : fmt::format("{}", fmt::join(imported.left_out, ", "))));
  const nlohmann::ordered_json json{{"weights", arguments.out.string()},
                                    {"net", imported.net},
                                    {"tensors", imported.file.tensors.size()},
                                    {"numbers", numbers},
                                    {"left_out", imported.left_out}};
  print_result(common, arguments.out, json_text(json));
}

void write_features(const WeightsArguments& arguments, const CommonOptions& common) {
  if (std::filesystem::exists(arguments.out))
    throw usage_error("is there already", "OUT", arguments.out.string(), "a new file");
  const Photo photo = read_photo(arguments.picture);
  Device device = Device::open(common.device);
  device.use_gemm(common.gemm);
  write_safetensors(arguments.out, imported_features(arguments.file, photo.image, device));
  std::printf("%s\n", arguments.out.c_str());
}

}  // namespace

void add_weights_commands(CommandLine& line) {
  auto arguments = std::make_shared<WeightsArguments>();
  line.describe_group("weights", "Weights and checkpoints of the nets");
  line.add("weights inspect", "What a file holds: metadata, and each tensor with its shape")
      .argument("FILE", "Weights or checkpoint (.safetensors)", arguments->file)
      .common({Common::Json, Common::Quiet})
      .run([arguments](const CommonOptions& common) { inspect(with_found_paths(*arguments), common); });
  line.add("weights export",
           "Weights for inference in half precision, with CARD.md and plots of validation beside them")
      .argument("FILE", "Checkpoint or weights of `clerestory train`, or a folder with the light's two files",
                arguments->file)
      .argument("OUT",
                "What to write. Maps: a file such as nets/weights/maps.safetensors. Light: the folder for "
                "light_local.safetensors and light_global.safetensors, such as nets/weights",
                arguments->out)
      .option("--gain", "NUMBER",
              "Light: what its part out of view is multiplied by, as experiments/configs/gain.toml finds it; default: "
              "as FILE says",
              arguments->gain)
      .common({Common::Device, Common::Quiet})
      .run([arguments](const CommonOptions& common) { export_weights(with_found_paths(*arguments), common); });
  line.add("weights average", "The mean of weights of maps that legs of one training left: often better than each")
      .argument("OUT", "What to write, in half precision, with second moments and mean maps of the last FILE",
                arguments->out)
      .arguments("FILE", "Weights or checkpoints of `clerestory train` that go back to the same first leg",
                 arguments->files, 2)
      .notes(
          "Nobody has judged the mean yet: `clerestory train CONFIG --init OUT train.steps=1 train.rate=0` does, with\n"
          "model.width and model.height as FILE has them, and `weights export` of that run writes its card.")
      .common({Common::Device, Common::Quiet})
      .run([arguments](const CommonOptions& common) { average(with_found_paths(*arguments), common); });
  line.add("weights import", "Weights that torchvision's DenseNet121, ResNet34 or VGG16 learned elsewhere, as ours")
      .argument("FILE", "Its state_dict(), saved as safetensors", arguments->file)
      .argument("OUT", "What to write: for `train --init` (DenseNet121, ResNet34) or loss.perceptual_weights (VGG16)",
                arguments->out)
      .common({Common::Json, Common::Quiet})
      .run([arguments](const CommonOptions& common) { import_weights(with_found_paths(*arguments), common); });
  line.add("weights features", "What an imported net makes of a picture, to be compared with torchvision's")
      .argument("FILE", "What `weights import` wrote", arguments->file)
      .argument("PICTURE", "PNG, JPEG, EXR or HDR", arguments->picture)
      .argument("OUT", "Features of each level (.safetensors)", arguments->out)
      .common({Common::Device, Common::Gemm, Common::Quiet})
      .run([arguments](const CommonOptions& common) { write_features(with_found_paths(*arguments), common); });
}

}  // namespace clerestory
