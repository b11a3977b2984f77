// From pictures and true maps on disk to what the nets see: size, exposure, units, masks. Training, evaluation and
// `invert` share these few functions, so that no figure depends on who prepared the input.
#pragma once
#include <cstdint>
#include <vector>

#include "experiments/evaluation/metrics.hpp"
#include "host/io/datasets.hpp"
#include "host/io/resize.hpp"

namespace clerestory {

/// The largest centred cut with the proportions width : height.
Image crop_to_aspect(const Image& image, int width, int height);
/// Grown to the right and below to multiples of `multiple` by repeating the last column and row, or filled with zeros.
Image pad_to_multiple(const Image& image, int multiple, bool repeat);
/// Left and right exchanged.
Image mirrored(const Image& image);
/// The same of normals in camera space, whose x changes its sign.
Image mirrored_normals(const Image& normal);
/// The part of this size that begins at (left, top).
Image window(const Image& image, int left, int top, int width, int height);
/// The upper left part.
Image cut(const Image& image, int width, int height);

/// Nets halve their input four times and the padding of a photograph is a multiple of this (replicated pixels).
constexpr int net_multiple = 32;
inline int padded_size(int size) { return (size + net_multiple - 1) / net_multiple * net_multiple; }

/// The middle of a view, as a longer lens would see it: all maps, and the camera.
RoomView centre_of(const RoomView& view, int width, int height);

/// What people say of two pixels' albedo: `darker` is darker than `other`, or both are equal.
struct JudgedPixels {
  int darker = 0, other = 0;  // y * width + x
  bool equal = false;
  float weight = 0;
};

/// A view as the nets see it, `width` x `height`, not yet padded.
struct PreparedView {
  Image image;   // 3 channels: linear, scaled so that the 95th percentile of luminance is 0.9; not clamped
  MapSet truth;  // depth relative to scene_scale (the farthest hundredth exceeds 1), 0 where masked
  MapMasks masks;
  double scene_scale = 0;                 // metres; 0 when no pixel has depth (all masks are then empty)
  std::optional<Camera> camera = {};      // of this grid of pixels, where the view has one
  std::vector<JudgedPixels> judged = {};  // of IIW's photographs
};

/// Which share of a view may lack geometry before its scene_scale says nothing: fewer valid pixels than this, and the
/// view's masks are empty.
constexpr double least_valid_share = 0.01;

/// Crops to the proportions of width x height, takes exposure and scene_scale at the file's own size, resizes image and
/// albedo by area and the rest by nearest neighbour. segGeo: valid pixels (finite depth, normal and albedo, by
/// read_view). segAlb: segGeo where nothing is emitted. segMat: segGeo where roughness and metallic are not both zero.
PreparedView prepare_view(const RoomView& view, int width, int height);

/// The picture that MGNet is fed: clamp(image * gain, 0, 1), padded to net_multiple by repetition.
Image net_input(const Image& image, double gain = 1);

/// A photograph: exposure brought to 0.9 (exposure_of), resized to net_size by area. `exposure` receives the factor.
Image prepare_photo(const Image& linear, int longer, double* exposure = nullptr);

}  // namespace clerestory
