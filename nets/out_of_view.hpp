// Light from outside of the picture (Zhu et al. 2022, section 4.3): a hypernetwork reads the whole photograph and
// writes the weights of a small radiance field, which is volume-rendered along rays.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "host/ops/light/march.hpp"
#include "nets/builder.hpp"
#include "nets/light_inputs.hpp"
#include "nets/light_shells.hpp"
#include "nets/resnet.hpp"

namespace clerestory {

/// Paper: two fully connected nets, one for weights, one for biases, as released: 216.6 M parameters. LowRank: each
/// matrix is a trained one plus a product of two thin ones that the hypernetwork writes.
enum class HyperNet { Paper, LowRank };

/// Field: the paper's radiance field, written by a hypernetwork. Shells: painted spheres (nets/light_shells.hpp).
enum class OutOfViewForm { Field, Shells };
OutOfViewForm out_of_view_form(const std::string& name);  // field | shells; throws usage_error

struct OutOfViewSize {
  OutOfViewForm form = OutOfViewForm::Field;
  ResnetSize trunk{};
  HyperNet hyper = HyperNet::Paper;
  int stem = 1024, inner = 4096;  // widths of the hypernetwork; LowRank has no inner layers
  int rank = 4;
  int octaves = 6;                         // of the position's encoding, beside the position itself
  std::vector<int> hidden = {64, 64, 64};  // of the field
  MarchOptions march{.segments = 64};
  bool released_output = true;  // relu for colour and density; false: softplus, which never dies
  bool log_input = false;       // a trunk without imagenet_input reads ln(1 + photograph)
  bool sees_maps = false;       // the trunk also reads albedo, normals, material and depth: beyond the paper
  bool background = false;      // what the field lets through meets a colour that the photograph decides
  ShellsSize shells{};
  double gain =
      1;  // of what is answered; chosen after a training, for logarithms learn a typical radiance, not its mean
};
/// "paper" or "compact"; throws usage_error otherwise.
OutOfViewSize out_of_view_size(const std::string& preset);

/// What one picture's light out of view is made of: weights {out, in, 1, 1} and biases {1, out, 1, 1} of each layer of
/// its field and, if it has one, the colour behind it {1, 3, 1, 1}; or its shells {count, 4, rows, columns}.
struct LightField {
  std::vector<Value> weights, biases;
  Value shells, background;
};

/// Of each picture. Surfaces and depth are read if `sees_maps`, the camera by shells.
std::vector<LightField> light_fields(const Scope& scope, const LightInputs& pictures, const OutOfViewSize& size);

/// What a form answers times its gain.
Value with_gain(Value light, const OutOfViewSize& size);

/// Radiance {1, 3, rows, samples} that arrives at `points` along `direction` (both {1, 3, rows, samples}, camera frame;
/// the direction points away). range {1, 3, 1, 1} by depth_range().
Value out_of_view_light(const LightField& field, Value points, Value direction, Value range, const OutOfViewSize& size);

}  // namespace clerestory
