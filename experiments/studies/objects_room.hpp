// One room of the study of mirror objects (objects_study.hpp): objects put into photographs of it, beside the tracer's.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/studies/strip.hpp"
#include "experiments/truth/room_list.hpp"
#include "host/cl/device.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

/// Who lights an object: a light of study_light(), with the maps of its method where maps are predicted.
struct ObjectAnswerer {
  std::string name;  // in results
  std::string light;
  std::filesystem::path maps;  // weights
  RenderSettings render;       // nets and samples
};

struct ObjectsOptions {
  int width = 320, height = 240;
  int photo_spp = 256, truth_spp = 1024;  // of the tracer's pictures
  double baseline = 0;                    // metres to a second camera, which takes a photograph of its own; 0: none
  std::vector<std::string> shapes;        // "ball", "bunny"
  double roughness = 0.02;                // of a metal of albedo 0.9
  std::vector<ObjectAnswerer> answerers;
};

/// An object in a photograph, over the pixels that it covers whole.
struct ObjectError {
  std::string maps, answerer, shape;  // maps: predicted or true
  double shown_psnr = 0;              // dB, of what a screen shows
  double smape = 0;                   // eps 0.01
  double gradients = 0;               // gradient_energy() over the truth's
};

struct ObjectsRoom {
  std::vector<ObjectError> errors;  // none where the room has no place for an object, or for a second camera
  std::vector<std::vector<StripPicture>> sheet;  // a row for each shape and camera: photograph, truth, answers
};
ObjectsRoom measure_objects_room(Device& device, const ListedRoom& room, const ObjectsOptions& options);

/// Mean over neighbours, both `used`, of the squared difference of ln(luminance + 0.01), as the product of those of two
/// independent estimates of one picture, so that noise adds nothing. Throws Error where no two neighbours are used.
double gradient_energy(const Image& a, const Image& b, const std::vector<bool>& used);

}  // namespace clerestory
