#include "experiments/weights/imported.hpp"

#include <algorithm>
#include <array>
#include <regex>

#include "experiments/weights/metadata.hpp"
#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "nets/densenet.hpp"
#include "nets/imagenet.hpp"
#include "nets/resnet.hpp"
#include "nets/vgg.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// A net of torchvision, and how its names tell it from others.
struct KnownNet {
  std::string name, title;
  std::string told_by;  // a tensor of its
  std::string scope;    // of our states
  std::string input;    // what it is shown, for people
  std::vector<Value> (*levels)(const Scope& scope, Value picture);
  std::vector<std::string> unread = {};  // beginnings of names: layers that nobody here reads
};

const std::array<KnownNet, 3>& known_nets() {
  static const std::string coded = "display-coded, less ImageNet's mean, over its deviation";
  static const std::array<KnownNet, 3> nets{
      {{"densenet121", "DenseNet121", "features.conv0.weight", "encoder", coded,
        [](const Scope& scope, Value picture) {
          const auto levels = densenet(scope, imagenet_input(picture), {});
          return std::vector<Value>(levels.begin(), levels.end());
        }},
       {"resnet34", "ResNet34", "layer1.0.conv1.weight", "encoder", coded,
        [](const Scope& scope, Value picture) { return resnet(scope, imagenet_input(picture), {}); }},
       {"vgg16",
        "VGG16",
        "features.0.weight",
        "vgg",
        "maps less ImageNet's mean, over its deviation",
        [](const Scope& scope, Value picture) { return std::vector<Value>{vgg_features(scope, picture)}; },
        {"features.17.", "features.19.", "features.21.", "features.24.", "features.26.", "features.28."}}}};
  return nets;
}

const KnownNet& net_told_by(const TensorFile& file, const std::string& where) {
  for (const KnownNet& net : known_nets())
    if (file.tensors.contains(net.told_by)) return net;
  throw usage_error("no net that is known here", where,
                    file.tensors.empty() ? "no tensors" : "first tensor " + file.tensors.begin()->first,
                    "torchvision's DenseNet121, ResNet34 or VGG16, whose tensors are named as its state_dict() does");
}

const KnownNet& net_named(const std::string& name, const std::string& where) {
  const auto found = std::ranges::find(known_nets(), name, &KnownNet::name);
  if (found == known_nets().end())
    throw usage_error("a net that is not known here", where + ": net", name, "densenet121, resnet34 or vgg16");
  return *found;
}

bool begins_with_any(const std::string& name, const std::vector<std::string>& beginnings) {
  return std::ranges::any_of(beginnings, [&](const std::string& b) { return name.starts_with(b); });
}

/// torchvision's name; its own files of DenseNet still say "denselayer1.norm.1.weight".
std::string name_today(const std::string& name) {
  static const std::regex old(R"((denselayer\d+\.(?:norm|conv))\.([12])\.)");
  return std::regex_replace(name, old, "$1$2.");
}

/// What torchvision keeps as {c} is {1, c, 1, 1} here.
std::vector<long> shape_there(const Shape& shape) {
  return shape.n == 1 && shape.plane() == 1 ? std::vector<long>{shape.c} : stored_shape(shape);
}

std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t most = 3;
  const std::vector<std::string> shown(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size())));
  const std::string text = fmt::format("{}", fmt::join(shown, ", "));
  return names.size() > most ? fmt::format("{} and {} more", text, names.size() - most) : text;
}

bool says_imported(const TensorFile& file) {
  const auto kind = file.metadata.find("kind");
  return kind != file.metadata.end() && kind->second == kImportedKind;
}

/// The tensors of a state dictionary, sorted into what is taken and what is not.
class Import {
 public:
  Import(TensorFile given, const KnownNet& net, std::string where)
      : given_(std::move(given)), net_(net), where_(std::move(where)) {}

  ImportedNet run() {
    Graph graph;
    net_.levels({graph, false, net_.scope}, graph.input("picture", {1, 3, 64, 64}));
    for (const auto& [state, shape] : states_of(graph)) take(state, shape);
    for (const auto& [name, tensor] : given_.tensors) sort_out(name);
    refuse("misses tensors", missing_);
    refuse("has tensors of other shapes", misshapen_);
    refuse("has tensors that are not its own", foreign_);
    return {net_.name, std::move(file_), left_out()};
  }

 private:
  void take(const std::string& state, const Shape& shape) {
    const auto found = given_.tensors.find(state.substr(net_.scope.size() + 1));
    if (found == given_.tensors.end()) return missing_.push_back(state.substr(net_.scope.size() + 1));
    const auto& [name, tensor] = *found;
    if (tensor.shape != shape_there(shape))
      misshapen_.push_back(
          fmt::format("{} {} instead of {}", name, shape_text(tensor.shape), shape_text(shape_there(shape))));
    else
      file_.tensors[state] = StoredTensor(stored_shape(shape), tensor.floats(where_ + ": tensor " + name));
    taken_.push_back(name);
  }

  void sort_out(const std::string& name) {
    static const std::vector<std::string> classifiers{"classifier.", "fc.", "pre_logits.",
                                                      "head."};  // the last: timm's
    if (std::ranges::find(taken_, name) != taken_.end()) return;
    if (name.ends_with(".num_batches_tracked"))
      ++counts_;
    else if (begins_with_any(name, classifiers))
      ++classifier_;
    else if (begins_with_any(name, net_.unread))
      ++unread_;
    else
      foreign_.push_back(name);
  }

  void refuse(const char* what, const std::vector<std::string>& names) const {
    if (!names.empty())
      throw usage_error(fmt::format("taken for torchvision's {}, but it {}", net_.title, what), where_, some_of(names),
                        "its state_dict()");
  }

  std::vector<std::string> left_out() const {
    std::vector<std::string> words;
    if (classifier_ > 0) words.push_back(fmt::format("the classifier ({} tensors)", classifier_));
    if (unread_ > 0) words.push_back(fmt::format("layers after relu3_3 ({} tensors)", unread_));
    if (counts_ > 0) words.push_back(fmt::format("num_batches_tracked ({} tensors)", counts_));
    return words;
  }

  TensorFile given_, file_;
  const KnownNet& net_;
  std::string where_;
  std::vector<std::string> taken_, missing_, misshapen_, foreign_;
  int counts_ = 0, classifier_ = 0, unread_ = 0;
};

}  // namespace

ImportedNet import_net(const fs::path& path) {
  const std::string where = path.string();
  TensorFile given = read_finite_safetensors(path);
  std::map<std::string, StoredTensor> renamed;
  for (auto& [name, tensor] : given.tensors) renamed[name_today(name)] = std::move(tensor);
  given.tensors = std::move(renamed);
  const KnownNet& net = net_told_by(given, where);
  ImportedNet imported = Import(std::move(given), net, where).run();
  imported.file.metadata = {{"kind", kImportedKind},
                            {"net", net.name},
                            {"origin", fmt::format("{}, hash {}", path.filename().string(), file_hash(path))},
                            {"input", net.input}};
  return imported;
}

bool is_imported(const fs::path& path) { return says_imported(read_safetensors(path)); }

TensorFile read_imported(const fs::path& path, const std::string& net) {
  TensorFile file = read_finite_safetensors(path);
  const auto said = [&](const char* key) {
    const auto found = file.metadata.find(key);
    return found == file.metadata.end() ? std::string("nothing") : found->second;
  };
  if (said("kind") != kImportedKind || said("net") != net)
    throw usage_error("is no imported net of this name", path.string(),
                      fmt::format("kind {}, net {}", said("kind"), said("net")),
                      fmt::format("{}, as `clerestory weights import` writes it", net));
  return file;
}

TensorFile imported_features(const fs::path& path, const Image& picture, Device device) {
  constexpr int least = 32;
  const std::string where = path.string();
  const TensorFile file = read_finite_safetensors(path);
  if (!says_imported(file))
    throw usage_error("is no imported net", where, "", "what `clerestory weights import` wrote");
  const KnownNet& net = net_named(fact(file, "net", where), where);
  if (std::min(picture.width, picture.height) < least)
    throw usage_error("the picture is too small for this net", where,
                      fmt::format("{}x{}", picture.width, picture.height), fmt::format("{} pixels each way", least));
  Graph graph;
  const Value image = graph.input("picture", {1, 3, picture.height, picture.width});
  const std::vector<Value> levels = net.levels({graph, false, net.scope}, image);
  const auto states = std::make_shared<States>(device);
  for (const auto& [name, shape] : states_of(graph)) set_state(*states, name, shape, file, where);
  Executor executor(compile(graph, levels, device), states);
  executor.feed("picture", picture.data);
  executor.run();
  TensorFile features;
  for (std::size_t i = 0; i < levels.size(); ++i)
    features.tensors[fmt::format("level{}", i)] =
        StoredTensor(stored_shape(levels[i].shape()), executor.fetch_floats(levels[i]));
  features.metadata = {{"net", net.name}, {"input", net.input}};
  return features;
}

}  // namespace clerestory
