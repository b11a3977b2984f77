#include "host/io/nyu.hpp"

#include <hdf5/serial/hdf5.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Sizes = std::vector<hsize_t>;

/// The innermost thing that libhdf5 has to say about its last failure.
std::string last_words() {
  std::string text;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* to) {
        auto& words = *static_cast<std::string*>(to);
        if (words.empty() && error->desc) words = error->desc;
        return herr_t{0};
      },
      &text);
  return text.empty() ? "libhdf5 does not say why" : text;
}

/// What libhdf5 hands out, closed at the end.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

std::string text_of(const Sizes& sizes) { return fmt::format("{}", fmt::join(sizes, "x")); }

/// A dataset and its sizes, checked before any memory is taken.
class Dataset {
 public:
  Dataset(hid_t file, const char* name, std::size_t dimensions, H5T_class_t kind, const std::string& where)
      : where_(where), name_(name), set_(open(file)) {
    const Handle space(H5Dget_space(set_), H5Sclose), type(H5Dget_type(set_), H5Tclose);
    const int found = H5Sget_simple_extent_ndims(space);
    sizes_.resize(static_cast<std::size_t>(std::max(found, 0)));
    if (found > 0) H5Sget_simple_extent_dims(space, sizes_.data(), nullptr);
    if (sizes_.size() != dimensions || !std::ranges::all_of(sizes_, [](hsize_t n) { return n >= 1 && n <= 65535; }))
      throw usage_error(fmt::format("wrong size of {}", name_), where_, text_of(sizes_),
                        fmt::format("{} sides of 1 to 65535", dimensions));
    // Wider whole numbers would be cut off at 255.
    const bool bytes = H5Tget_size(type) == 1 && H5Tget_sign(type) == H5T_SGN_NONE;
    if (H5Tget_class(type) != kind || (kind == H5T_INTEGER && !bytes))
      throw usage_error(fmt::format("wrong type of {}", name_), where_, {},
                        kind == H5T_INTEGER ? "whole numbers of 8 bits" : "floating point numbers");
  }

  const Sizes& sizes() const { return sizes_; }

  /// The part of all whose first index is `index`.
  template <class T>
  std::vector<T> slice(hsize_t index, hid_t type) const {
    Sizes start(sizes_.size(), 0), count = sizes_;
    start[0] = index, count[0] = 1;
    std::size_t values = 1;
    for (const hsize_t n : count) values *= n;
    std::vector<T> out(values);
    const Handle space(H5Dget_space(set_), H5Sclose),
        memory(H5Screate_simple(static_cast<int>(count.size()), count.data(), nullptr), H5Sclose);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
        H5Dread(set_, type, memory, space, H5P_DEFAULT, out.data()) < 0)
      throw usage_error(fmt::format("{} cannot be read: {}", name_, last_words()), where_);
    return out;
  }

 private:
  Handle open(hid_t file) const {
    if (H5Lexists(file, name_, H5P_DEFAULT) <= 0) throw usage_error(fmt::format("holds no {}", name_), where_);
    const hid_t id = H5Dopen2(file, name_, H5P_DEFAULT);
    if (id < 0) throw usage_error(fmt::format("{} cannot be read: {}", name_, last_words()), where_);
    return {id, H5Dclose};
  }

  std::string where_;
  const char* name_;
  Handle set_;
  Sizes sizes_;
};

/// libhdf5 prints its failures to stderr unless it is told not to.
void keep_quiet() {
  static const herr_t once = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  (void)once;
}

Handle opened(const fs::path& path) {
  keep_quiet();
  InputFile exists(path);  // a better message than libhdf5's
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0)
    throw usage_error("cannot be read: " + last_words(), path.string(), {}, "HDF5, as MATLAB's format 7.3 is");
  return {id, H5Fclose};
}

/// MATLAB keeps columns together: a file's sides stand in the reverse order of an Image's.
template <class T, class Value>
Image upright(const std::vector<T>& values, int width, int height, int channels, const Value& value) {
  Image image(width, height, channels);
  std::size_t at = 0;
  for (int c = 0; c < channels; ++c)
    for (int x = 0; x < width; ++x)
      for (int y = 0; y < height; ++y) image.at(c, y, x) = value(values[at++]);
  return image;
}

template <class T, class Value>
std::vector<T> by_columns(const Image& image, const Value& value) {
  std::vector<T> values;
  values.reserve(image.data.size());
  for (int c = 0; c < image.channels; ++c)
    for (int x = 0; x < image.width; ++x)
      for (int y = 0; y < image.height; ++y) values.push_back(value(image.at(c, y, x)));
  return values;
}

}  // namespace

struct NyuFile::State {
  std::string where;
  Handle file;
  Dataset images, depths;

  explicit State(const fs::path& path)
      : where(path.string()),
        file(opened(path)),
        images(file, "images", 4, H5T_INTEGER, where),
        depths(file, "depths", 3, H5T_FLOAT, where) {
    const Sizes &i = images.sizes(), &d = depths.sizes();
    if (i[1] != 3 || 3 * i[2] * i[3] > max_image_values)
      throw usage_error("wrong size of images", where, text_of(i), "N x 3 x width x height");
    if (d != Sizes{i[0], i[2], i[3]})
      throw usage_error("depths and images differ in size", where, text_of(d), text_of({i[0], i[2], i[3]}));
  }
  int side(std::size_t k) const { return static_cast<int>(depths.sizes()[k]); }
  hsize_t index(int number) const {
    if (number < 1 || number > side(0))
      throw usage_error("there is no such picture", where, fmt::format("{}", number), fmt::format("1 to {}", side(0)));
    return static_cast<hsize_t>(number - 1);
  }
};

NyuFile::NyuFile(const fs::path& path) : state_(std::make_unique<State>(path)) {}
NyuFile::~NyuFile() = default;
int NyuFile::size() const { return state_->side(0); }
int NyuFile::width() const { return state_->side(1); }
int NyuFile::height() const { return state_->side(2); }

Image NyuFile::picture(int number) const {
  const auto values = state_->images.slice<std::uint8_t>(state_->index(number), H5T_NATIVE_UINT8);
  return upright(values, width(), height(), 3,
                 [](std::uint8_t v) { return static_cast<float>(std::pow(v / 255.0, 2.2)); });
}

Image NyuFile::depth(int number) const {
  const auto values = state_->depths.slice<float>(state_->index(number), H5T_NATIVE_FLOAT);
  Image depth = upright(values, width(), height(), 1, [](float v) { return v; });
  for (std::size_t i = 0; i < depth.data.size(); ++i)
    if (!std::isfinite(depth.data[i]) || depth.data[i] < 0)
      throw usage_error(fmt::format("a depth of picture {} is wrong", number), state_->where,
                        fmt::format("{} at {}", depth.data[i], place_of(depth, i)), "metres, 0 for none");
  return depth;
}

namespace {

constexpr hsize_t kUserBlock = 512;  // MATLAB's own header, before HDF5 begins

Error not_written(const fs::path& path) {
  return {ErrorKind::Failed, "cannot be written: " + last_words(), path.string()};
}

Handle in_memory(const fs::path& path) {
  keep_quiet();
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose), access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_userblock(creation, kUserBlock);
  H5Pset_fapl_core(access, std::size_t{1} << 24, false);
  const hid_t id = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access);
  if (id < 0) throw not_written(path);
  return {id, H5Fclose};
}

/// A dataset of a type that MATLAB knows by the name `matlab`.
Handle created(hid_t file, const char* name, const Sizes& sizes, hid_t type, const std::string& matlab,
               const fs::path& path) {
  const Handle space(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose);
  Handle set(H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  const Handle text(H5Tcopy(H5T_C_S1), H5Tclose), single(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(text, matlab.size());
  const Handle attribute(H5Acreate2(set, "MATLAB_class", text, single, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (set < 0 || H5Awrite(attribute, text, matlab.data()) < 0) throw not_written(path);
  return set;
}

std::string matlab_header() {
  std::string header = "MATLAB 7.3 MAT-file, written by Clerestory";
  header.resize(124, ' ');  // text, and the place of data of sub-systems, of which there are none
  header += std::string("\x00\x02", 2) + "IM";
  header.resize(kUserBlock, '\0');
  return header;
}

}  // namespace

struct NyuWriter::State {
  fs::path path;
  int count, width, height;
  AtomicFile out;
  Handle file, images, depths;

  State(const fs::path& to, int n, int w, int h)
      : path(to),
        count(n),
        width(w),
        height(h),
        out(to),
        file(in_memory(to)),
        images(created(file, "images", sizes({n, 3, w, h}), H5T_STD_U8LE, "uint8", to)),
        depths(created(file, "depths", sizes({n, w, h}), H5T_IEEE_F32LE, "single", to)) {}

  static Sizes sizes(const std::vector<int>& sides) { return {sides.begin(), sides.end()}; }

  template <class T>
  void write(hid_t set, int number, const std::vector<T>& values, const std::vector<int>& sides, hid_t type) const {
    const Sizes part = sizes(sides);
    Sizes start(part.size(), 0);
    start[0] = static_cast<hsize_t>(number - 1);
    const Handle space(H5Dget_space(set), H5Sclose),
        memory(H5Screate_simple(static_cast<int>(part.size()), part.data(), nullptr), H5Sclose);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, part.data(), nullptr) < 0 ||
        H5Dwrite(set, type, memory, space, H5P_DEFAULT, values.data()) < 0)
      throw not_written(path);
  }
};

NyuWriter::NyuWriter(const fs::path& path, int count, int width, int height)
    : state_(std::make_unique<State>(path, count, width, height)) {}
NyuWriter::~NyuWriter() = default;

void NyuWriter::put(int number, const Image& shown, const Image& depth) {
  const State& s = *state_;
  for (const auto& [image, channels] : {std::pair{&shown, 3}, {&depth, 1}})
    if (image->width != s.width || image->height != s.height || image->channels != channels)
      throw Error(ErrorKind::Failed, "pictures of one file have one size", s.path.string(),
                  fmt::format("{}x{}x{}", image->width, image->height, image->channels),
                  fmt::format("{}x{}x{}", s.width, s.height, channels));
  const auto bytes = by_columns<std::uint8_t>(
      shown, [](float v) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0f, 1.0f))); });
  s.write(s.images, number, bytes, {1, 3, s.width, s.height}, H5T_NATIVE_UINT8);
  s.write(s.depths, number, by_columns<float>(depth, [](float v) { return v; }), {1, s.width, s.height},
          H5T_NATIVE_FLOAT);
}

void NyuWriter::commit() {
  State& s = *state_;
  if (H5Fflush(s.file, H5F_SCOPE_GLOBAL) < 0) throw not_written(s.path);
  const ssize_t size = H5Fget_file_image(s.file, nullptr, 0);  // what follows the user block
  std::string bytes(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
  if (size <= 0 || H5Fget_file_image(s.file, bytes.data(), bytes.size()) != size) throw not_written(s.path);
  s.out.write(matlab_header());
  s.out.write(bytes);
  s.out.commit();
}

std::string nyu_name(int number) { return fmt::format("{:04}", number); }

namespace {

fs::path beside(const fs::path& folder, const char* kind, int number) {
  return folder / kind / (nyu_name(number) + ".png");
}

}  // namespace

NyuNormals read_nyu_normals(const fs::path& folder, int number) {
  const fs::path file = beside(folder, "normals", number), mask_file = beside(folder, "masks", number);
  NyuNormals read{read_map(file, 3), {}};
  const Image mask = read_image(mask_file);
  if (mask.width != read.normal.width || mask.height != read.normal.height)
    throw usage_error("is of another size than the normals", mask_file.string(),
                      fmt::format("{}x{}", mask.width, mask.height),
                      fmt::format("{}x{}", read.normal.width, read.normal.height));
  read.mask = Image(mask.width, mask.height, 1);
  for (float& v : read.normal.data) v = 2 * v - 1;
  for (std::size_t i = 0; i < mask.pixels(); ++i) {
    bool counts = true;
    for (int c = 0; c < mask.channels; ++c) counts = counts && mask.plane(c)[i] == 1;
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += std::pow(read.normal.plane(c)[i], 2.0);
    read.mask.data[i] = counts && squares > 0 ? 1 : 0;
    for (int c = 0; c < 3 && squares > 0; ++c)
      read.normal.plane(c)[i] = static_cast<float>(read.normal.plane(c)[i] / std::sqrt(squares));
  }
  return read;
}

void write_nyu_normals(const fs::path& folder, int number, const NyuNormals& normals) {
  make_directories(folder / "normals"), make_directories(folder / "masks");
  Image coded = normals.normal;
  for (float& v : coded.data) v = 0.5f + 0.5f * v;
  write_png(beside(folder, "normals", number), coded, Encoding::Linear);
  write_png(beside(folder, "masks", number), normals.mask, Encoding::Linear);
}

}  // namespace clerestory
