// Weights of torchvision's nets from elsewhere: what comes of their state dictionaries against torchvision itself,
// where they go, and every way in which a file may be wrong.
#include "experiments/weights/imported.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/training/network.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/graph/plan.hpp"
#include "nets/densenet.hpp"
#include "nets/imagenet.hpp"
#include "nets/resnet.hpp"
#include "nets/vgg.hpp"
#include "tests/experiments/training_run.hpp"
#include "tests/message_of.hpp"
#include "tests/nets/golden.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::Each;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

constexpr Shape kPicture{1, 3, 48, 64};
const std::array<std::string, 3> kNets{"densenet121", "resnet34", "vgg16"};

const TensorFile& golden() {
  static const TensorFile file = read_safetensors(std::string(CLERESTORY_TEST_DATA) + "/nets/imported.safetensors");
  return file;
}

/// What golden_nets.py gives a tensor of a state dictionary.
StoredTensor learned(const std::string& name, const std::vector<long>& shape) {
  long count = 1, fan_in = 1;
  for (std::size_t i = 0; i < shape.size(); ++i) count *= shape[i], fan_in *= i > 0 ? shape[i] : 1;
  if (shape.empty()) return {shape, std::vector<std::uint64_t>{7}};  // num_batches_tracked
  const bool norm = name.ends_with("weight") && shape.size() == 1;
  std::vector<float> values;
  for (const double u : formula(name, {1, 1, 1, static_cast<int>(count)}).real) {
    if (shape.size() == 4)
      values.push_back(static_cast<float>(u * std::sqrt(24.0 / static_cast<double>(fan_in))));
    else
      values.push_back(static_cast<float>(name.ends_with("running_var") ? 1 + 0.5 * u : (norm ? 1 : 0) + 0.25 * u));
  }
  return {shape, std::move(values)};
}

/// A state dictionary whose names and shapes torchvision itself has said, less what VGG16's classifier multiplies with:
/// half a gigabyte that nobody reads.
const TensorFile& state_dict(const std::string& net) {
  static std::map<std::string, TensorFile> made;
  TensorFile& file = made[net];
  if (!file.tensors.empty()) return file;
  const auto shapes = nlohmann::json::parse(golden().metadata.at("shapes_" + net));
  for (const auto& [name, shape] : shapes.items())
    if (net != "vgg16" || !name.starts_with("classifier") || shape.size() == 1)
      file.tensors[name] = learned(net + "." + name, shape.get<std::vector<long>>());
  return file;
}

/// Files of the nets, written and imported once.
class Imported : public testing::Test {
 protected:
  static void SetUpTestSuite() { folder_ = std::make_unique<ScratchFolder>("clerestory-imported"); }
  static void TearDownTestSuite() { folder_.reset(); }

  static fs::path write(const std::string& name, const TensorFile& file) {
    const fs::path path = *folder_ / (name + ".safetensors");
    write_safetensors(path, file);
    return path;
  }
  static fs::path given(const std::string& net) {
    const fs::path path = *folder_ / (net + ".safetensors");
    return fs::exists(path) ? path : write(net, state_dict(net));
  }
  static fs::path imported(const std::string& net) {
    const fs::path path = *folder_ / (net + "_ours.safetensors");
    if (!fs::exists(path)) write_safetensors(path, import_net(given(net)).file);
    return path;
  }
  /// What is said of a net's state dictionary after a change.
  static std::string refused(const std::string& net, const std::function<void(TensorFile&)>& change) {
    TensorFile file = state_dict(net);
    change(file);
    return message_of([&] { import_net(write("refused", file)); }, ErrorKind::Usage);
  }

  static inline std::unique_ptr<ScratchFolder> folder_;
};

std::vector<Value> levels_of(const std::string& net, Graph& graph, Value picture) {
  if (net == "vgg16") return {vgg_features({graph, false, "vgg"}, picture)};
  const Scope scope{graph, false, "encoder"};
  if (net == "resnet34") return resnet(scope, imagenet_input(picture), {});
  const auto levels = densenet(scope, imagenet_input(picture), {});
  return {levels.begin(), levels.end()};
}

Tensor golden_picture() {
  Tensor picture = formula("image", kPicture);
  for (double& x : picture.real) x += 0.5;
  return picture;
}

TEST_F(Imported, GivesTorchvisionsFeaturesInDouble) {
  for (const std::string& net : kNets) {
    const TensorFile file = read_safetensors(imported(net));
    const Device device = device_for(Precision::Double);
    Graph graph;
    const std::vector<Value> levels = levels_of(net, graph, graph.input("picture", kPicture));
    const auto states = std::make_shared<States>(device, Precision::Double);
    for (const Value& v : graph.states()) {
      const std::string& name = static_cast<const StateOp&>(*v.node->op).state_name;
      states->set(name, Tensor(v.shape(), file.get(name, net).floats()));
    }
    EXPECT_EQ(graph.states().size(), file.tensors.size()) << net;
    Executor executor(compile(graph, levels, device, {.precision = Precision::Double}), states);
    executor.feed("picture", golden_picture());
    executor.run();
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const std::string name = fmt::format("{}.level{}", net, i);
      const std::vector<float>& want = golden().get(name, "golden values").floats();
      const Tensor got = executor.fetch(levels[i]);
      const std::size_t stride = got.real.size() / want.size();
      double largest = 0, worst = 0;
      for (const float w : want) largest = std::max(largest, std::abs(static_cast<double>(w)));
      for (std::size_t k = 0; k < want.size(); ++k)
        worst = worse(worst, std::abs(got.real[k * stride] - static_cast<double>(want[k])));
      EXPECT_GT(largest, 0) << name;
      // Golden values are stored in float; double's own rounding is far below.
      EXPECT_LE(worst, 0x1p-23 * largest) << name;
    }
  }
}

TEST_F(Imported, GivesTorchvisionsFeaturesInFloat) {
  Image picture(kPicture.w, kPicture.h, 3);
  picture.data = golden_picture().floats();
  for (const std::string& net : kNets) {
    const TensorFile features = imported_features(imported(net), picture, Device::open());
    EXPECT_EQ(features.tensors.size(), net == "vgg16" ? 1u : 5u);
    for (const auto& [name, tensor] : features.tensors) {
      const std::vector<float>& want = golden().get(net + "." + name, "golden values").floats();
      const std::size_t stride = tensor.count() / want.size();
      double error = 0, norm = 0;
      for (std::size_t k = 0; k < want.size(); ++k) {
        const double w = want[k], d = tensor.floats()[k * stride] - w;
        error += d * d, norm += w * w;
      }
      // As far as four times torchvision's own float run lies from its double run: both round, each in its own order,
      // and ours adds up to 4608 products one after the other where theirs adds blocks.
      EXPECT_LE(std::sqrt(error / norm), 4 * std::stod(golden().metadata.at("float_error_" + net))) << net << name;
    }
  }
}

TEST_F(Imported, SaysWhatItLeavesOutAndWhereItCameFrom) {
  const ImportedNet dense = import_net(given("densenet121")), vgg = import_net(given("vgg16"));
  EXPECT_EQ(dense.net, "densenet121");
  EXPECT_EQ(dense.file.tensors.size(), 604u);  // of 727: 121 counts, a classifier of two
  EXPECT_THAT(dense.left_out, ElementsAre("the classifier (2 tensors)", "num_batches_tracked (121 tensors)"));
  EXPECT_THAT(vgg.left_out, ElementsAre("the classifier (3 tensors)", "layers after relu3_3 (12 tensors)"));
  const TensorFile kept = read_safetensors(imported("vgg16"));
  EXPECT_TRUE(kept.checksummed);
  EXPECT_EQ(kept.metadata.at("net"), "vgg16");
  EXPECT_THAT(kept.metadata.at("origin"), HasSubstr("vgg16.safetensors, hash "));
  EXPECT_EQ(kept.tensors.at("vgg.features.0.bias").shape, (std::vector<long>{1, 64, 1, 1}));
}

TEST_F(Imported, ReadsOldNamesAndHalfPrecision) {
  TensorFile old;  // as torchvision's published file of DenseNet121 has them
  for (const auto& [name, tensor] : state_dict("densenet121").tensors) {
    std::string renamed = name;
    const std::size_t layer = renamed.find("denselayer");
    for (const char* part : {"norm1", "norm2", "conv1", "conv2"})
      if (const std::size_t at = renamed.find(part, layer); layer != std::string::npos && at != std::string::npos)
        renamed.insert(renamed.begin() + static_cast<std::ptrdiff_t>(at + 4), '.');
    old.tensors[renamed] = tensor;
  }
  ASSERT_TRUE(old.tensors.contains("features.denseblock1.denselayer1.norm.1.weight"));
  const TensorFile now = read_safetensors(imported("densenet121")), then = import_net(write("old", old)).file;
  for (const auto& [name, tensor] : now.tensors) EXPECT_EQ(then.get(name, "old").floats(), tensor.floats()) << name;

  const fs::path half = *folder_ / "half.safetensors";
  write_safetensors(half, state_dict("vgg16"), FloatStorage::F16);
  const TensorFile rounded = import_net(half).file, exact = read_safetensors(imported("vgg16"));
  const std::vector<float>&a = rounded.get("vgg.features.0.weight", "half").floats(),
        &b = exact.get("vgg.features.0.weight", "exact").floats();
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 0x1p-11 * std::abs(b[i]) + 0x1p-25);
}

TEST_F(Imported, RefusesWhatIsNoneOfThem) {
  const std::string weight = "layer2.1.conv2.weight";
  EXPECT_THAT(refused("resnet34", [&](TensorFile& f) { f.tensors.erase(weight); }),
              testing::AllOf(HasSubstr("ResNet34"), HasSubstr("misses tensors"), HasSubstr(weight)));
  EXPECT_THAT(refused("resnet34",
                      [&](TensorFile& f) {
                        f.tensors[weight].shape = {128, 1152, 1, 1};
                      }),
              testing::AllOf(HasSubstr("other shapes"), HasSubstr("128x1152x1x1 instead of 128x128x3x3")));
  EXPECT_THAT(refused("resnet34", [&](TensorFile& f) { f.tensors["layer1.0.conv3.weight"] = f.tensors[weight]; }),
              testing::AllOf(HasSubstr("not its own"), HasSubstr("layer1.0.conv3.weight")));
  EXPECT_THAT(
      refused("vgg16", [](TensorFile& f) { f.tensors["features.16.weight"] = f.tensors["features.14.weight"]; }),
      HasSubstr("features.16.weight"));  // VGG19
  EXPECT_THAT(refused("vgg16",
                      [](TensorFile& f) {
                        std::vector<float> values = f.tensors["features.5.bias"].floats();
                        values[3] = NAN;
                        f.tensors["features.5.bias"].values = values;
                      }),
              testing::AllOf(HasSubstr("not finite"), HasSubstr("features.5.bias"), HasSubstr("nan at 3")));
  EXPECT_THAT(refused("vgg16", [](TensorFile& f) { f.tensors["features.5.bias"].values = std::vector<int>(128); }),
              testing::AllOf(HasSubstr("another type"), HasSubstr("features.5.bias")));
  EXPECT_THAT(refused("vgg16",
                      [](TensorFile& f) {
                        f.tensors = {{"blocks.0.attn.weight", StoredTensor({1}, std::vector<float>{1})}};
                      }),
              testing::AllOf(HasSubstr("no net that is known"), HasSubstr("blocks.0.attn.weight")));
  fs::copy_file(given("vgg16"), *folder_ / "cut.safetensors", fs::copy_options::overwrite_existing);
  fs::resize_file(*folder_ / "cut.safetensors", fs::file_size(given("vgg16")) - 1);
  EXPECT_THAT(message_of([] { import_net(*folder_ / "cut.safetensors"); }, ErrorKind::Usage),
              HasSubstr("cut.safetensors"));
  EXPECT_THAT(message_of([] { import_net(*folder_ / "nowhere.safetensors"); }, ErrorKind::Usage),
              HasSubstr("nowhere.safetensors"));
}

/// Names whose states differ from what the file holds, or are not there.
std::vector<std::string> differing(const States& states, const fs::path& path, const std::string& scope) {
  std::vector<std::string> names;
  for (const auto& [name, tensor] : read_safetensors(path).tensors)
    if (!states.has(scope + name) || states.get(scope + name).floats() != tensor.floats()) names.push_back(name);
  return names;
}

TEST_F(Imported, StartsEncodersThatItFits) {
  const Device device = Device::open();
  MgnetSize paper = mgnet_size("paper");
  std::get<DensenetSize>(paper.encoder).imagenet_input = true;
  States maps(device);
  read_encoder_weights(imported("densenet121"), maps, maps_states(paper));
  EXPECT_THAT(differing(maps, imported("densenet121"), ""), testing::IsEmpty());
  States none(device);
  for (const char* net : {"resnet34", "vgg16"})
    EXPECT_THAT(message_of([&] { read_encoder_weights(imported(net), none, maps_states(paper)); }, ErrorKind::Usage),
                HasSubstr("encoder.features.conv0.weight"));
  EXPECT_THAT(
      message_of([&] { read_encoder_weights(imported("densenet121"), none, maps_states(mgnet_size("compact"))); },
                 ErrorKind::Usage),
      HasSubstr("another encoder"));

  States light(device);
  LightSizes sizes = light_sizes("paper");
  read_encoder_weights(imported("resnet34"), light, light_states(sizes));
  EXPECT_THAT(differing(light, imported("resnet34"), "global."), testing::IsEmpty());
  // LightNet's own trunk ends after the third stage.
  const std::vector<std::string> local = differing(light, imported("resnet34"), "local.");
  EXPECT_FALSE(local.empty());
  EXPECT_THAT(local, Each(HasSubstr("encoder.layer4.")));
  sizes.out_of_view.sees_maps = true;
  EXPECT_THAT(
      message_of([&] { read_encoder_weights(imported("resnet34"), none, light_states(sizes)); }, ErrorKind::Usage),
      HasSubstr("for global.encoder.conv1.weight"));
}

TEST_F(Imported, IsNoWholeNet) {
  EXPECT_THAT(message_of([] { load_weights(imported("densenet121"), Device::open()); }, ErrorKind::Usage),
              HasSubstr("these are weights of an encoder"));
}

TEST_F(Imported, TheTextOfANetSaysWhatItsEncoderReads) {
  MgnetSize net = mgnet_size("paper");
  const std::string plain = net_text(net);
  std::get<DensenetSize>(net.encoder).imagenet_input = true;
  const std::string text = net_text(net);
  EXPECT_NE(text, plain);
  EXPECT_EQ(net_text(net_from_text(text, "test")), text);
  EXPECT_EQ(net_text(net_from_text(plain, "test")), plain);
  EXPECT_THROW(net_from_text("growth 32, 64 first channels, layers 6-12-24-16, input gamma, decoder 32-16-16-8-4", "t"),
               Error);
}

/// Trainings that start from imported weights.
struct ImportedRun : TrainingRun {
  std::string imported(const std::string& net) const {
    const fs::path given = folder / (net + ".safetensors"), ours = folder / (net + "_ours.safetensors");
    write_safetensors(given, state_dict(net));
    write_safetensors(ours, import_net(given).file);
    return ours.string();
  }
};

TEST_F(ImportedRun, TrainsFromAnImportedEncoder) {
  const std::string encoder = imported("densenet121");
  const auto begin = [&](const std::string& root, std::vector<std::string> more) {
    more.insert(more.end(), {"model.preset=paper", "model.growth=0", "model.first=0", "model.layers=[]",
                             "train.steps=1", "train.encoder_rate=0", "model.init=" + encoder});
    return run(root, more);
  };
  const TrainingOutcome outcome = begin("runs", {"model.input=imagenet"});
  const TensorFile weights = read_safetensors(outcome.weights), learned = read_safetensors(encoder);
  EXPECT_THAT(weights.metadata.at("net"), HasSubstr("input imagenet"));
  EXPECT_EQ(read_history(outcome.weights).legs[0].init, "densenet121_ours.safetensors");
  const std::string name = "encoder.features.denseblock3.denselayer7.conv2.weight";
  const std::vector<float>&now = weights.get(name, "weights").floats(), &before = learned.get(name, "learned").floats();
  for (std::size_t i = 0; i < now.size(); ++i)  // weights are kept in half precision
    ASSERT_NEAR(now[i], before[i], 0x1p-11 * std::abs(before[i]) + 0x1p-25);
  EXPECT_THAT(message_of([&] { begin("plain", {}); }, ErrorKind::Usage), HasSubstr("model.input = imagenet"));
  EXPECT_THAT(message_of(
                  [&] {
                    run("lite", {"model.preset=lite", "model.growth=0", "model.first=0", "model.layers=[]",
                                 "model.decoder=[8,8,8,8,8,8]", "model.input=imagenet", "train.steps=1"});
                  },
                  ErrorKind::Usage),
              HasSubstr("model.input"));
}

TEST_F(ImportedRun, ThePerceptualLossLooksThroughVgg) {
  const std::string vgg = imported("vgg16");
  const TrainingOptions options =
      training_options(config("runs", {"train.steps=1", "loss.perceptual_weights=" + vgg, "train.batch=1"}));
  const auto states = std::make_shared<States>(Device::open());
  const TrainingNetwork network(Device::open(), options, states);
  EXPECT_THAT(differing(*states, vgg, ""), testing::IsEmpty());
  const std::string raw = (folder / "vgg16.safetensors").string();
  const TrainingOptions wrong =
      training_options(config("runs", {"train.steps=1", "loss.perceptual_weights=" + raw, "train.batch=1"}));
  EXPECT_THAT(message_of([&] { TrainingNetwork(Device::open(), wrong, states); }, ErrorKind::Usage),
              HasSubstr("weights import"));
}

TEST_F(ImportedRun, TheProgramImportsAndRefuses) {
  const fs::path given = folder / "vgg16.safetensors", out = folder / "new/vgg16_ours.safetensors";
  write_safetensors(given, state_dict("vgg16"));
  const auto says = [&](const std::vector<std::string>& words, int code) {
    EXPECT_EQ(Program(words, folder / "said.txt").wait(), code);
    return text_of(folder / "said.txt");
  };
  EXPECT_THAT(says({"weights", "import", given.string(), out.string()}, 0),
              testing::AllOf(HasSubstr("left out: the classifier"), HasSubstr(out.string())));
  EXPECT_THAT(says({"weights", "inspect", out.string()}, 0), HasSubstr("checksums agree"));
  EXPECT_EQ(Program({"weights", "import", given.string(), out.string()}, folder / "said.txt").wait(), 0);  // again
  EXPECT_THAT(says({"weights", "import", given.string(), given.string()}, 2), HasSubstr("no import wrote it"));
  EXPECT_THAT(says({"weights", "import", out.string(), (folder / "twice.safetensors").string()}, 2),
              HasSubstr("no net that is known"));
  EXPECT_FALSE(fs::exists(folder / "twice.safetensors"));

  write_exr(folder / "picture.exr", Image(40, 36, 3));
  const fs::path features = folder / "features.safetensors";
  says({"weights", "features", out.string(), (folder / "picture.exr").string(), features.string()}, 0);
  EXPECT_EQ(read_safetensors(features).tensors.at("level0").shape, (std::vector<long>{1, 256, 9, 10}));
  EXPECT_THAT(says({"weights", "features", given.string(), (folder / "picture.exr").string(), features.string()}, 2),
              HasSubstr("is there already"));
  const std::string none = (folder / "none.safetensors").string();
  EXPECT_THAT(says({"weights", "features", given.string(), (folder / "picture.exr").string(), none}, 2),
              HasSubstr("is no imported net"));
  write_exr(folder / "small.exr", Image(40, 31, 3));
  EXPECT_THAT(says({"weights", "features", out.string(), (folder / "small.exr").string(), none}, 2),
              HasSubstr("40x31"));
}

}  // namespace
}  // namespace clerestory
