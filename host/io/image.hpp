// Pictures and maps: PNG, JPEG, EXR and Radiance HDR in, EXR and PNG out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace clerestory {

/// Planar floats: channel, row, column (NCHW with N = 1). Row 0 is the top.
struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> data;

  Image() = default;
  Image(int w, int h, int c, float value = 0)
      : width(w), height(h), channels(c), data(static_cast<std::size_t>(w) * h * c, value) {}
  std::size_t pixels() const { return static_cast<std::size_t>(width) * height; }
  float& at(int c, int y, int x) { return data[index(c, y, x)]; }
  float at(int c, int y, int x) const { return data[index(c, y, x)]; }
  float* plane(int c) { return data.data() + index(c, 0, 0); }
  const float* plane(int c) const { return data.data() + index(c, 0, 0); }

 private:
  std::size_t index(int c, int y, int x) const { return (static_cast<std::size_t>(c) * height + y) * width + x; }
};

/// Every value times `factor`, rounded once.
void scale(std::vector<float>& values, double factor);
Image scaled(Image image, double factor);

/// One channel of an image, as an image.
Image channel(const Image& image, int c);

/// Every `stride`-th pixel from (x, y) on; what is left of a step at the ends is not in it.
Image every_nth(const Image& image, int stride, int x, int y);

/// "channel c, pixel (x, y)" of a position in `data`, for messages.
std::string place_of(const Image& image, std::size_t index);

/// Largest picture that is read: channels x pixels.
constexpr std::uint64_t max_image_values = std::uint64_t{1} << 28;

/// A picture as it is stored: 8 and 16 bit values divided by 255 and 65535, EXR and HDR values as they are. Alpha is
/// dropped (colours are not multiplied by it); R, G, B come in this order, other channels in the file's order; a JPEG
/// or PNG is turned upright as its EXIF orientation says. The format is known by content, not by name. Throws
/// usage_error: missing, folder, empty, no picture, truncated, zero-sized, or a header that claims more than
/// `max_image_values` or more than the file can hold (checked before memory is taken).
Image read_image(const std::filesystem::path& path);

/// The same of a file in memory, which messages call `where`.
Image decode_image(const std::string& bytes, const std::string& where);

/// The same, and whether alpha was dropped.
std::pair<Image, bool> read_image_and_alpha(const std::filesystem::path& path);

/// A map with exactly `channels` channels (1 or 3). One channel may have any name; of a file with several, channel Y is
/// taken for 1, and R, G, B for 3. Throws usage_error naming the channels found.
Image read_map(const std::filesystem::path& path, int channels);

enum class Encoding { Linear, Gamma };  // as stored, or 8/16-bit raised to 2.2
struct Photo {
  Image image;  // 3 channels, linear Rec.709 radiance, finite, not negative
  Encoding encoding = Encoding::Linear;
  double focal = 0;           // focal length in pixels as EXIF says it of the uncropped picture; 0: it does not
  std::uint64_t clamped = 0;  // negative values set to 0
  std::string note;           // one line that says what was done, for the user
};
/// A photograph: 8/16-bit pictures through (v/255)^2.2, EXR and HDR as they are, grey expanded to three channels, then
/// check_radiance.
Photo read_photo(const std::filesystem::path& path);

/// Radiance must be finite: throws usage_error naming the first offending pixel and `where` on NaN or Inf. Negative
/// values (real panoramas ring below zero) become 0; returns how many.
std::uint64_t check_radiance(Image& image, const std::filesystem::path& where);

enum class ExrType { Half, Float };
/// Text kept in an EXR header.
using ExrText = std::map<std::string, std::string>;
/// One channel per name; without names "Y" for one and "R","G","B" for three channels. Atomic; ZIP. A finite value that
/// does not fit into half (|v| > 65504) throws Error naming it. Equal content gives equal bytes: no date is stored.
void write_exr(const std::filesystem::path& path, const Image& image, ExrType type = ExrType::Half,
               std::vector<std::string> names = {}, const ExrText& text = {});
/// Whether every finite value of the image can be stored in half.
bool fits_half(const Image& image);

/// 8-bit PNG of 1 or 3 channels, values clamped to [0, 1]: Gamma raises to 1/2.2 first (previews), Linear stores them
/// (masks). Throws Error on a value that is not finite. Atomic.
void write_png(const std::filesystem::path& path, const Image& image, Encoding encoding = Encoding::Gamma);

/// The PNG itself in memory, for a report that embeds it.
std::string encode_png(const Image& image, Encoding encoding, const std::string& where);
/// Alike a JPEG, of quality 1 to 100, with colour at half the size as cameras keep it.
std::string encode_jpeg(const Image& image, int quality, Encoding encoding, const std::string& where);

}  // namespace clerestory
