// Data sets on disk: rooms in InteriorVerse's layout (ours and the original), and RGB-D frames.
//
// A room: <root>/<room>/NNN_{im,mask,albedo,depth,material,normal}.exr with <root>/{train,val,test}.txt, one room per
// line; depth in millimetres, inf where there is none. Generated rooms add NNN_camera.json, NNN_emission.exr and the
// files of light (light_files.hpp). In memory depth is always metres with 0 for none.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/error.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/image.hpp"

namespace clerestory {

/// Rooms of a split ("train", "val", "test"), in the file's order. Throws usage_error when the list is missing, or
/// holds a name twice, a name that leaves the root, or a room without a folder; such lines go to `bad` instead, if it
/// is given.
std::vector<std::string> list_rooms(const std::filesystem::path& root, const std::string& split,
                                    const std::function<void(const Error&)>& bad = {});
/// Writes <split>.txt.
void write_rooms(const std::filesystem::path& root, const std::string& split, const std::vector<std::string>& rooms);
/// Ids ("000") of the views of a room, sorted: those that have a file NNN_<map>.exr of any of these maps.
std::vector<std::string> list_views(const std::filesystem::path& room, const std::vector<std::string>& maps = {"im"});
/// "007" of 7.
std::string view_id(int number);
/// <room>/<id>_<what>.<extension>.
std::filesystem::path view_file(const std::filesystem::path& room, const std::string& id, const std::string& what,
                                const std::string& extension = "exr");

/// One view of a room. Images have one size. Depth: metres, 0 none. Material: R roughness, G metallic, B unused.
/// Emission: radiance emitted, 0 elsewhere.
struct RoomView {
  Image image, mask, albedo, depth, material, normal;  // 3, 1, 3, 1, 3, 3 channels
  std::optional<Image> emission;                       // 3 channels
  std::optional<Camera> camera;
  double exposure = 1;  // factor already in image and emission
};

/// Which files to read; what is not read stays an empty image.
struct ViewParts {
  bool image = true, mask = true, albedo = true, depth = true, material = true, normal = true, emission = true,
       camera = true;
};

/// Pixels that a view's mask calls valid and that its maps do not fill: what reading took away.
struct UnfilledPixels {
  std::size_t albedo = 0, depth = 0, material = 0, normal = 0;
  std::size_t normal_length = 0;  // normals with a length beyond 1 +- 0.01: they were made unit length
};

/// Reads a view and makes it clean: pixels whose depth, normal, albedo or material is not finite, whose normal has no
/// length or whose depth is not positive have mask 0 (and 0 in the offending map); normals come out unit length;
/// NaN or Inf in the image is an error, negative radiance becomes 0. Throws usage_error naming the file; missing files
/// (but emission and camera) are errors. `unfilled` gets what was at fault.
RoomView read_view(const std::filesystem::path& room, const std::string& id, const ViewParts& parts = {},
                   UnfilledPixels* unfilled = nullptr);
/// The same for a path ROOM/NNN.
RoomView read_view(const std::filesystem::path& room_and_id, const ViewParts& parts = {});
/// Whether ROOM/NNN names a view: no folder of that name, but a file ROOM/NNN_im.exr or ROOM/NNN_depth.exr.
bool is_view(const std::filesystem::path& room_and_id);

/// Writes a view in the same layout and units (depth to millimetres, 0 to inf). Depth and normal are stored in float,
/// the others in half (image and emission in float when a value is too large for it). NNN_im.exr is written last: a
/// view that has it is complete. Throws Error on a value that is not finite or on unlike sizes.
void write_view(const std::filesystem::path& room, const std::string& id, const RoomView& view);

/// Metres with 0 for none <-> millimetres with inf for none.
void millimetres_to_metres(Image& depth);
void metres_to_millimetres(Image& depth);

/// Maps given to `invert --gbuffer`: a folder with albedo.exr, normal.exr, depth.exr, material.exr in the names and
/// units of a run, or a view ROOM/NNN. Material: R roughness, G metallic, B emission flag.
struct GBuffer {
  std::optional<Image> albedo, normal, depth, material;  // 3, 3, 1, 3 channels
  std::optional<Image> mask;                             // of a view
  std::optional<CameraFile> camera;
};
/// Absent files stay empty, but at least one map must be there; all have one size. Checks ranges: albedo, roughness and
/// metallic in [0, 1] (to 1e-3, then clamped), depth not negative, everything finite. Throws usage_error naming the
/// file. Without `camera` none is read: somebody knows better.
GBuffer read_gbuffer(const std::filesystem::path& path, bool camera = true);

/// A photograph with measured depth: a folder with rgb.png, rgb.jpg or left.png, depth.exr (axial metres, 0 none) and
/// camera.json (camera_file.hpp).
struct RgbdFrame {
  Photo photo;
  Image depth;  // 1 channel, metres, 0 none
  CameraFile camera;
  std::optional<Image> right;  // right.png of a rectified pair, linear
};
RgbdFrame read_rgbd(const std::filesystem::path& folder);

}  // namespace clerestory
