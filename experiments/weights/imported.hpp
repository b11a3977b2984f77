// Nets of torchvision that have learned on ImageNet elsewhere, as ours: DenseNet121 and ResNet34 are encoders, VGG16 is
// what the perceptual loss looks through.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/graph/plan.hpp"
#include "host/io/image.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

/// metadata["kind"] of a file that import_net() made.
inline constexpr const char* kImportedKind = "encoder";

/// A state dictionary under the names of our states, in float: "encoder.features.conv0.weight", "encoder.conv1.weight",
/// "vgg.features.0.weight". Numbers are as they were: what such a net is shown (nets/imagenet.hpp) is not folded into
/// them. Metadata: kind = encoder, net, origin (name and hash of the file), input.
struct ImportedNet {
  std::string net;  // densenet121 | resnet34 | vgg16
  TensorFile file;
  std::vector<std::string> left_out;  // in words: the classifier, counts of batches, layers that nobody reads
};

/// Which of the three it is the names tell. Throws usage_error naming the file, and every tensor (the first of many)
/// that is missing, has another shape or belongs to another net; or the first value that is no finite number.
ImportedNet import_net(const std::filesystem::path& path);

/// Whether import_net() made this file. Throws usage_error when it is no safetensors file.
bool is_imported(const std::filesystem::path& path);
/// What import_net() made of `net`; throws usage_error when it is something else.
TensorFile read_imported(const std::filesystem::path& path, const std::string& net);

/// What an imported net makes of a picture of linear radiance, each side at least 32: "level0" and on, {1, c, h, w}.
/// The encoders are shown it display-coded, VGG16 as it is, both less ImageNet's mean and over its deviation.
TensorFile imported_features(const std::filesystem::path& path, const Image& picture, Device device);

}  // namespace clerestory
