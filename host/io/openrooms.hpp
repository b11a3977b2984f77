// OpenRooms (Li et al. 2021), the layout that Li et al. 2020 learn from: <root>/<kind>/<scene>/ with view N in
//   im_N.hdr            linear radiance                 imbaseColor_N.png   albedo^(1/2.2)
//   imnormal_N.png      127.5 + 127.5 n                 imroughness_N.png   roughness
//   imdepth_N.dat       height, width, metres           immask_N.png        0 outside, 0.5 a lamp, 1 an object
//   imenv_N.hdr         incident light: a tile of 32 azimuths x 16 elevations for every fourth pixel of both sides
// and <root>/{train,test}.txt, a scene a line. Kinds are main_xml and so on; where only lamps differ from another
// kind's (DiffLight) normals and depth are that one's, where only materials do (DiffMat) depth and mask.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/io/image.hpp"

namespace clerestory {

inline constexpr int openrooms_azimuths = 32, openrooms_elevations = 16, openrooms_stride = 4;

struct OpenRoomsView {
  Image image, albedo, normal;   // 3 channels: linear, linear, unit length or 0
  Image roughness, depth, mask;  // 1 channel; depth: metres, 0 none; mask: 0, 0.5 or 1
  std::optional<Image> light;    // tiles side by side, linear; of some views only
};

/// Where a view lies.
struct OpenRoomsName {
  std::filesystem::path root;
  std::string kind, scene;
  int number = 0;
  std::string text() const { return kind + "/" + scene + "/" + std::to_string(number); }
};

/// Throws usage_error naming the file: missing, of another size than the picture, a depth file that says another size
/// than it has, tiles of a wrong size.
OpenRoomsView read_openrooms(const OpenRoomsName& name);
/// Every view that has a picture of the scenes of <split>.txt, by kind, scene and number. Throws usage_error where
/// there is no list, or no view.
std::vector<OpenRoomsName> list_openrooms(const std::filesystem::path& root, const std::string& split);
/// Whether a folder of kinds is there.
bool is_openrooms(const std::filesystem::path& root);
void write_openrooms(const OpenRoomsName& name, const OpenRoomsView& view);

}  // namespace clerestory
