// The losses MGNet is trained with (Zhu et al. 2022, equation 8, with the terms of the released code).
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "nets/mgnet.hpp"

namespace clerestory {

/// What people say of the albedo at pairs of pixels, all {1, 1, rows, pairs}: pixels Int, counted over all pictures and
/// rows (y + h picture) w + x, or -1, and weights of a pair that is equal, and of one whose first is darker.
struct JudgedAlbedo {
  Value first, second, equal, ordered;
};

/// What the maps are compared with. Masks {n, 1, h, w} weigh pixels; scale_mask {n, 1, 1, 1} is 1 where log_scale is
/// known.
struct MapTargets {
  Value albedo, normal, material, depth, log_scale;
  Value albedo_mask, geometry_mask, material_mask, scale_mask;
  JudgedAlbedo judged = {};  // no values: nobody has
};

/// Whose terms: of Zhu et al. 2022, or of Li et al. 2020.
enum class MapLosses { Zhu, Li2020 };
MapLosses map_losses_of(const std::string& name);  // zhu | li2020; throws usage_error

/// What the perceptual distance looks through; none of it is trained.
struct PerceptualFeatures {
  enum class From {
    Imported,  // VGG16's relu3_3 with ImageNet's weights, as in the paper
    Random,    // the same net with random weights
    Rooms      // an encoder of MGNet that has learned on rooms, at 1/4 of the map
  };
  From from = From::Imported;
  MgnetSize encoder = {};  // Rooms: of this net

  /// First part of the names of its states.
  const char* scope() const { return from == From::Rooms ? "rooms" : "vgg"; }
};

/// Weights of the terms. perceptual is a part of the albedo, normal and material terms; 0 leaves its features out.
struct LossWeights {
  double albedo = 1, normal = 1, material = 1, depth = 1, scale = 1, perceptual = 0, log_depth = 0, metallic = 0,
         judgements = 0, depth_detail = 0, albedo_detail = 0;
  MapLosses terms = MapLosses::Zhu;
  PerceptualFeatures features = {};
};

/// Distance of the features f of two maps (one channel, repeated, or three) times the mask {n, 1, h, w}, which is
/// averaged to the features' size; {1, 1, 1, 1}, over the whole batch. With c channels of features:
///   Imported       <|f' - f|^2>_m / c
///   Random, Rooms  <|f' - f|^2>_m / <|f|^2>_m: a part of the true map's, whatever size the features of a net have
/// Rooms sees a map as MGNet sees a photograph; no value may be below 0. States are "<scope>.*". Sides: multiples of 4.
Value perceptual_distance(const Scope& scope, Value prediction, Value truth, Value mask,
                          const PerceptualFeatures& through = {});

/// <(e - 0.85 mean e)^2>_m with e = ln(D' + 0.01) - ln(D + 0.01), the mean over each picture's mask detached.
Value log_depth_loss(Value prediction, Value truth, Value mask);

/// How much of an error changes from place to place, at four scales; {1, 1, 1, 1}. With e_0 = error {n, c, h, w}, e_k+1
/// its masked means over 2x2, each as fine as e_k when it is grown again, bilinear over what the mask {n, 1, h, w} has:
///   sum_k <sum_c |e_k - grown e_k+1|>_mk / c
/// What all of a surface is wrong by counts at its border alone; a bent wall and a blurred edge do (in place of the
/// differences of neighbours of Li and Snavely 2018, MegaDepth). Sides: multiples of 16.
Value detail_loss(Value error, Value mask);

/// -<M ln(M' + 0.01) + (1 - M) ln(1.01 - M')>_m: least at 1.02 M - 0.01 within [0, 1], M the mean, so near it that it
/// is for the squared error, but steep where metal is given a metallic near 0: there the squared error of a sigmoid has
/// next to no gradient, and metal is rare.
Value metallic_entropy(Value prediction, Value truth, Value mask);

/// 2 (sum of equal d^2 + sum of ordered relu(d + 0.5)^2) with d = l(first) - l(second), l the logarithm of the mean of
/// albedo's channels + 0.001: the fine-tuning on IIW of Li et al. 2020. albedo {n, 3, h, w}.
Value judgement_loss(Value albedo, const JudgedAlbedo& judged);

/// The terms by name, each 1x1x1x1, weighted; "loss" is first and is their sum. With <.>_m a masked mean and perc the
/// perceptual distance:
///   albedo    0.5 (<(ln(1 + A') - ln(1 + A))^2>_m over pixels and channels + w perc)
///   normal    0.5 (<|1 - n'.n|>_m + w perc); all but Imported features see (n + 1) / 2
///   material  0.5 (<(R' - R)^2 + (M' - M)^2>_m + w (perc_R + perc_M) / 2), each map repeated to three channels
///   depth     <(ln(1 + max(0, s D')) - ln(1 + D))^2>_m, s the least-squares scale of each picture, detached
///   log_depth log_depth_loss, beyond the paper (Eigen et al. 2014): sees relative error however near the surface; what
///             is left of the mean holds the scale, which the term above lets drift to where the output's clamp has no
///             gradient
///   depth_detail, albedo_detail  detail_loss of ln(D' + 0.01) - ln(D + 0.01) and of ln(1 + A') - ln(1 + A), beyond the
///             paper: the squared terms see what is large, not what is sharp
///   metallic  metallic_entropy, beyond the paper: has the squared term's minimum, but its slope where metal is missed
///   scale     <(l' - l)^2>, beyond the paper: ln of the scene's scale
///   judgements  judgement_loss, where people have judged, under both kinds of terms
/// Those of Li et al., without a perceptual part, with s as above and means over channels, too:
///   albedo    6 <(clamp(s A', 0, 1) - A)^2>_m      normal  4 <|n' - n|^2>_m
///   material  2 <(2 R' - 2 R)^2>_m, of their [-1, 1]  depth   2 <(ln(1 + max(0, s D')) - ln(1 + D))^2>_m
using NamedValues = std::vector<std::pair<std::string, Value>>;
NamedValues mgnet_losses(const Scope& scope, const Maps& maps, const MapTargets& truth, const LossWeights& weights);

}  // namespace clerestory
