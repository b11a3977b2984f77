// NYU Depth V2 (Silberman et al. 2012): the labelled pictures with depth in one file of MATLAB's format 7.3, which is
// HDF5, and normals and masks beside it as pictures, as Li et al. 2020 keep them:
//   nyu_depth_v2_labeled.mat   images (N x 3 x width x height, 8 bits), depths (N x width x height, metres, filled)
//   normals/NNNN.png           127.5 + 127.5 n, camera space: x right, y up, z towards the viewer
//   masks/NNNN.png             255 in all channels where the normal counts
// Pictures are numbered from 1 on, as MATLAB counts. The file is read by libhdf5.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "host/io/image.hpp"

namespace clerestory {

inline const char* const kNyuFile = "nyu_depth_v2_labeled.mat";

class NyuFile {
 public:
  /// Throws usage_error naming the file: no HDF5, ended early, without images or depths, or of unlike sizes.
  explicit NyuFile(const std::filesystem::path& path);
  ~NyuFile();
  NyuFile(const NyuFile&) = delete;
  NyuFile& operator=(const NyuFile&) = delete;

  int size() const;
  int width() const;
  int height() const;
  /// Linear radiance, by (v/255)^2.2. Throws usage_error where there is no such picture, or it cannot be read.
  Image picture(int number) const;
  /// Metres, 0 for none; throws also where one is negative or not finite.
  Image depth(int number) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The same file, written whole at its end; nothing remains without commit(). It is kept in memory until then.
class NyuWriter {
 public:
  NyuWriter(const std::filesystem::path& path, int count, int width, int height);
  ~NyuWriter();
  NyuWriter(const NyuWriter&) = delete;
  NyuWriter& operator=(const NyuWriter&) = delete;

  /// A picture of values in [0, 1] as they are to be stored in 8 bits, and its depth in metres.
  void put(int number, const Image& shown, const Image& depth);
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// "0007": how pictures are called in lists and folders.
std::string nyu_name(int number);

struct NyuNormals {
  Image normal;  // unit length where the mask is set
  Image mask;    // 1 channel: 1 where the normal counts
};
/// normals/NNNN.png and masks/NNNN.png of `folder`. Throws usage_error naming the file.
NyuNormals read_nyu_normals(const std::filesystem::path& folder, int number);
void write_nyu_normals(const std::filesystem::path& folder, int number, const NyuNormals& normals);

}  // namespace clerestory
