// Decoding and encoding through OpenImageIO, always from and to memory: one place opens files (host/io/files.cpp), and
// a full disk or a broken rename cannot leave half a picture.
#include "host/io/image.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/finite.hpp"

namespace clerestory {
namespace {

// No codec here packs more than deflate's 1032 to 1 by much; a header that claims more lies.
constexpr std::uint64_t largest_compression = 2048;
// DWA keeps a black picture in some hundred bytes for 256 lines.
constexpr std::uint64_t largest_dwa_compression = 1 << 18;
// Decoders take memory for up to 256 rows at once, however few there are.
constexpr int longest_side = 1 << 16;

struct Format {
  const char* plugin;  // OpenImageIO's name
  const char* name;
};

struct Decoded {
  Image image;
  std::vector<std::string> names;  // of the channels kept
  std::string format;              // for messages: "8-bit PNG"
  Encoding encoding = Encoding::Linear;
  bool alpha_dropped = false, turned = false;
  double focal = 0;  // pixels; 0: not said
};

Format format_of(std::string_view bytes, const std::string& where) {
  const auto starts = [&](std::string_view magic) { return bytes.substr(0, magic.size()) == magic; };
  if (starts("\x89PNG\r\n\x1a\n")) return {"png", "PNG"};
  if (starts("\xff\xd8\xff")) return {"jpeg", "JPEG"};
  if (starts("\x76\x2f\x31\x01")) return {"openexr", "OpenEXR"};
  if (starts("#?")) return {"hdr", "Radiance HDR"};
  throw usage_error("is not a picture that can be read", where, {}, "PNG, JPEG, OpenEXR or Radiance HDR");
}

void check_header(const OIIO::ImageSpec& spec, const Format& format, std::uint64_t file_bytes,
                  const std::string& where) {
  const std::string size = fmt::format("{}x{}, {} channels", spec.width, spec.height, spec.nchannels);
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0)
    throw usage_error("the picture has no pixels", where, size);
  if (spec.deep) throw usage_error("deep pictures are not read", where);
  if (spec.depth > 1) throw usage_error("volumes are not read", where);
  const bool whole = spec.x == spec.full_x && spec.y == spec.full_y && spec.width == spec.full_width &&
                     spec.height == spec.full_height;
  if (format.plugin == std::string_view("openexr") && !whole)
    throw usage_error("the data window is not the display window: a part of a picture", where,
                      fmt::format("{} at {},{}", size, spec.x, spec.y),
                      fmt::format("all {}x{} pixels", spec.full_width, spec.full_height));
  if (std::max(spec.width, spec.height) > longest_side)
    throw usage_error("the picture is too large", where, size, fmt::format("sides of at most {} pixels", longest_side));
  // Each factor is below 2^31 and the first product is checked before the second is formed: no overflow.
  const auto pixels = static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height);
  const auto channels = static_cast<std::uint64_t>(spec.nchannels);
  if (pixels > max_image_values || pixels * channels > max_image_values)
    throw usage_error("the picture is too large", where, size, fmt::format("at most {} values", max_image_values));
  const bool dwa = spec.get_string_attribute("compression").substr(0, 3) == "dwa";
  if (pixels * channels * spec.channel_bytes() / (dwa ? largest_dwa_compression : largest_compression) > file_bytes)
    throw usage_error("the header claims more pixels than the file can hold", where, size,
                      fmt::format("what fits into {} bytes", file_bytes));
  using OIIO::TypeDesc;
  const auto base = spec.format.basetype;
  if (base != TypeDesc::UINT8 && base != TypeDesc::UINT16 && base != TypeDesc::HALF && base != TypeDesc::FLOAT)
    throw usage_error("the pixel type is not read", where, spec.format.c_str(), "uint8, uint16, half or float");
}

// Positions of R, G, B where all three are there; else of every channel but alpha. A single channel may have any name.
std::vector<int> channels_to_keep(const OIIO::ImageSpec& spec) {
  if (spec.nchannels == 1) return {0};
  std::vector<int> rgb;
  for (const char* name : {"R", "G", "B"}) {
    const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), name);
    if (at != spec.channelnames.end()) rgb.push_back(static_cast<int>(at - spec.channelnames.begin()));
  }
  if (rgb.size() == 3) return rgb;
  std::vector<int> all;
  for (int c = 0; c < spec.nchannels; ++c)
    if (c != spec.alpha_channel) all.push_back(c);
  return all;
}

// EXIF orientation o of a stored picture: where pixel (x, y) of the upright one lies in it.
Image upright(const Image& stored, int orientation) {
  const bool transposed = orientation >= 5;
  Image image(transposed ? stored.height : stored.width, transposed ? stored.width : stored.height, stored.channels);
  const bool flip_x = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool flip_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const int sx = transposed ? y : x, sy = transposed ? x : y;
        image.at(c, y, x) = stored.at(c, flip_y ? stored.height - 1 - sy : sy, flip_x ? stored.width - 1 - sx : sx);
      }
  return image;
}

// OpenImageIO 2.4 exchanges the numbers of Radiance's "+X +Y" and "-X -Y", whose columns are stored one after another.
int orientation_of(const OIIO::ImageSpec& spec, const Format& format) {
  const int said = spec.get_int_attribute("Orientation", 1);
  const bool exchanged = std::string_view(format.plugin) == "hdr" && (said == 6 || said == 8);
  return exchanged ? 14 - said : said;
}

// Focal length in pixels of the stored picture; 0 where EXIF does not say. What is said "as of 35 mm film" goes by the
// diagonal, 43.27 mm of it (CIPA DCG-001); else by millimetres and the sensor's resolution, of the picture as it left
// the camera, PixelXDimension wide.
double focal_pixels(const OIIO::ImageSpec& spec) {
  const auto said = [&](const char* name) {
    const float value = spec.get_float_attribute(name, 0);
    return std::isfinite(value) && value > 0 ? static_cast<double>(value) : 0;
  };
  const double on_film = said("Exif:FocalLengthIn35mmFilm");
  if (on_film > 0) return on_film * std::hypot(spec.width, spec.height) / std::hypot(36, 24);
  const double unit = spec.get_int_attribute("Exif:FocalPlaneResolutionUnit", 2) == 3 ? 10 : 25.4;  // mm
  const double of_camera = said("Exif:FocalLength") * said("Exif:FocalPlaneXResolution") / unit;
  const double width = said("Exif:PixelXDimension");
  return width > 0 ? of_camera * spec.width / width : of_camera;
}

/// Whether a JPEG's last scan comes to an end. Scans hold neither marker.
bool ends(const std::string& jpeg) {
  const std::size_t scan = jpeg.rfind("\xff\xda"), end = jpeg.rfind("\xff\xd9");
  return scan != std::string::npos && end != std::string::npos && end > scan;
}

// The library's message, unless it is about stray bytes between the markers of a JPEG, which do no harm: it is the
// first, and no other comes after it, not even that the file ends too early.
std::string failure_of(OIIO::ImageInput& input, bool read, const std::string& bytes) {
  if (!input.has_error()) return read ? "" : "unknown error";
  std::string message = input.geterror();
  if (read && message.find("extraneous bytes") != std::string::npos) return ends(bytes) ? "" : "ends too early";
  std::replace(message.begin(), message.end(), '\n', ' ');
  return message;
}

/// OpenImageIO 2.4 reads before the first byte where a damaged OpenEXR file points there.
class Bytes : public OIIO::Filesystem::IOMemReader {
 public:
  explicit Bytes(const std::string& bytes) : IOMemReader(bytes.data(), bytes.size()) {}
  std::size_t pread(void* to, std::size_t size, std::int64_t offset) override {
    return offset < 0 ? 0 : IOMemReader::pread(to, size, offset);
  }
};

Decoded decode(const std::string& bytes, const std::string& where) {
  const Format format = format_of(bytes, where);
  Bytes reader(bytes);
  const auto input = OIIO::ImageInput::create(format.plugin);
  if (!input) throw Error(ErrorKind::Failed, "no decoder for " + std::string(format.name), where);
  input->set_ioproxy(&reader);
  OIIO::ImageSpec spec, wish;
  wish["oiio:UnassociatedAlpha"] = 1;  // colours as stored, not multiplied by alpha
  if (!input->open(where, spec, wish))
    throw usage_error(fmt::format("is no valid {}: {}", format.name, failure_of(*input, false, bytes)), where);
  check_header(spec, format, bytes.size(), where);

  std::vector<float> interleaved(static_cast<std::size_t>(spec.image_pixels()) * spec.nchannels);
  const bool read = input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, interleaved.data());
  const std::string failure = failure_of(*input, read, bytes);
  if (!failure.empty()) throw usage_error(fmt::format("{} is damaged or truncated: {}", format.name, failure), where);

  const std::vector<int> keep = channels_to_keep(spec);
  Decoded out;
  out.image = Image(spec.width, spec.height, static_cast<int>(keep.size()));
  for (std::size_t c = 0; c < keep.size(); ++c) {
    float* plane = out.image.plane(static_cast<int>(c));
    for (std::size_t i = 0; i < out.image.pixels(); ++i) plane[i] = interleaved[i * spec.nchannels + keep[c]];
    out.names.push_back(spec.channelnames[keep[c]]);
  }
  out.alpha_dropped = spec.alpha_channel >= 0 && spec.nchannels > 1;
  const int orientation = orientation_of(spec, format);
  if (orientation > 1 && orientation <= 8) out.image = upright(out.image, orientation), out.turned = true;
  out.focal = focal_pixels(spec);
  const bool integer = !spec.format.is_floating_point();
  out.encoding = integer ? Encoding::Gamma : Encoding::Linear;
  out.format = integer ? fmt::format("{}-bit {}", 8 * spec.format.size(), format.name) : format.name;
  return out;
}

Decoded decode(const std::filesystem::path& path) { return decode(read_file(path), path.string()); }

std::string list(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

}  // namespace

void scale(std::vector<float>& values, double factor) {
  for (float& v : values) v = static_cast<float>(v * factor);
}

Image scaled(Image image, double factor) {
  scale(image.data, factor);
  return image;
}

Image channel(const Image& image, int c) {
  Image one(image.width, image.height, 1);
  std::copy_n(image.plane(c), one.data.size(), one.data.begin());
  return one;
}

Image every_nth(const Image& image, int stride, int x0, int y0) {
  Image out(image.width / stride, image.height / stride, image.channels);
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x) out.at(c, y, x) = image.at(c, stride * y + y0, stride * x + x0);
  return out;
}

std::string place_of(const Image& image, std::size_t index) {
  const std::size_t pixel = index % image.pixels();
  return fmt::format("channel {}, pixel ({}, {})", index / image.pixels(), pixel % image.width, pixel / image.width);
}

Image read_image(const std::filesystem::path& path) { return decode(path).image; }

Image decode_image(const std::string& bytes, const std::string& where) { return decode(bytes, where).image; }

std::pair<Image, bool> read_image_and_alpha(const std::filesystem::path& path) {
  Decoded decoded = decode(path);
  return {std::move(decoded.image), decoded.alpha_dropped};
}

Image read_map(const std::filesystem::path& path, int channels) {
  Decoded decoded = decode(path);
  if (decoded.image.channels == channels) return std::move(decoded.image);
  const auto y = std::find(decoded.names.begin(), decoded.names.end(), "Y");
  if (channels == 1 && y != decoded.names.end()) {
    Image map(decoded.image.width, decoded.image.height, 1);
    std::copy_n(decoded.image.plane(static_cast<int>(y - decoded.names.begin())), map.pixels(), map.data.begin());
    return map;
  }
  throw usage_error("wrong channels", path.string(), fmt::format("{}: {}", decoded.image.channels, list(decoded.names)),
                    channels == 1 ? "1, or one named Y" : fmt::format("{}: R, G, B", channels));
}

Photo read_photo(const std::filesystem::path& path) {
  Decoded decoded = decode(path);
  Photo photo;
  photo.encoding = decoded.encoding, photo.focal = decoded.focal;
  photo.note = decoded.format + (decoded.encoding == Encoding::Gamma ? ", made linear by (v/max)^2.2"
                                                                     : ", taken as linear radiance as it is");
  if (decoded.alpha_dropped) photo.note += "; alpha dropped";
  if (decoded.turned) photo.note += "; turned upright as its orientation says";
  if (decoded.image.channels == 1) {
    photo.image = Image(decoded.image.width, decoded.image.height, 3);
    for (int c = 0; c < 3; ++c) std::copy(decoded.image.data.begin(), decoded.image.data.end(), photo.image.plane(c));
    photo.note += "; grey copied to three channels";
  } else if (decoded.image.channels == 3) {
    photo.image = std::move(decoded.image);
  } else {
    throw usage_error("a photograph has one or three channels", path.string(),
                      fmt::format("{}: {}", decoded.image.channels, list(decoded.names)));
  }
  if (photo.encoding == Encoding::Gamma)
    for (float& v : photo.image.data) v = std::pow(v, 2.2f);
  photo.clamped = check_radiance(photo.image, path);
  if (photo.clamped > 0) photo.note += fmt::format("; {} negative values set to 0", photo.clamped);
  return photo;
}

void check_finite(const Image& image, const std::filesystem::path& where) {
  // Pixel by pixel, so that the first offender is the first in reading order and not in the first plane.
  for (std::size_t i = 0; i < image.pixels(); ++i)
    for (int c = 0; c < image.channels; ++c)
      if (const float v = image.plane(c)[i]; !std::isfinite(v))
        throw usage_error("a value is not finite", where.string(),
                          fmt::format("{} at {}", v, place_of(image, i + image.pixels() * c)));
}

std::uint64_t check_radiance(Image& image, const std::filesystem::path& where) {
  check_finite(image, where);
  std::uint64_t clamped = 0;
  for (float& v : image.data)
    if (v < 0) v = 0, ++clamped;
  return clamped;
}

}  // namespace clerestory
