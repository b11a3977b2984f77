// Encoding to memory, then one atomic write: a full disk or a broken rename cannot leave half a picture. EXR goes
// through OpenEXR itself, as OpenImageIO's writer puts the time of day into each header and equal pictures would
// differ.
#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"

namespace clerestory {
namespace {

constexpr float half_max = 65504;

void check_to_write(const Image& image, const std::string& where) {
  if (image.width <= 0 || image.height <= 0 || image.channels <= 0)
    throw Error(ErrorKind::Failed, "the picture to write is empty", where,
                fmt::format("{}x{}, {} channels", image.width, image.height, image.channels));
  if (image.data.size() != image.pixels() * image.channels)
    throw Error(ErrorKind::Failed, "the picture to write has the wrong number of values", where,
                fmt::format("{}", image.data.size()), fmt::format("{}", image.pixels() * image.channels));
}

constexpr float kDark = 1.0f / 1024;  // half's steps of 6e-8 are then coarse beside the brightest pixel

bool overflows_half(float v) { return std::isfinite(v) && std::abs(v) > half_max; }

std::vector<half> to_half(const Image& image, const std::string& where) {
  std::vector<half> values(image.data.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (overflows_half(image.data[i]))
      throw Error(ErrorKind::Failed, "a value does not fit into half precision", where,
                  fmt::format("{} at {}", image.data[i], place_of(image, i)), fmt::format("at most {}", half_max));
    values[i] = half(image.data[i]);
  }
  return values;
}

class MemoryStream : public Imf::OStream {
 public:
  explicit MemoryStream(const std::string& name) : OStream(name.c_str()) {}
  void write(const char data[], int count) override {
    const std::size_t end = at_ + static_cast<std::size_t>(count);
    if (end > bytes_.size()) bytes_.resize(end);
    std::copy_n(data, count, bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ = end;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t position) override { at_ = position; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

std::string encode_exr(const Image& image, ExrType type, const std::vector<std::string>& names, const ExrText& text,
                       const std::string& where) {
  const Imf::PixelType pixel = type == ExrType::Half ? Imf::HALF : Imf::FLOAT;
  const std::size_t size = type == ExrType::Half ? sizeof(half) : sizeof(float);
  std::vector<half> halves;
  if (type == ExrType::Half) halves = to_half(image, where);
  const char* data = type == ExrType::Half ? reinterpret_cast<const char*>(halves.data())
                                           : reinterpret_cast<const char*>(image.data.data());
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [key, value] : text) header.insert(key, Imf::StringAttribute(value));
  Imf::FrameBuffer planes;
  for (int c = 0; c < image.channels; ++c) {
    const std::string& name = names[static_cast<std::size_t>(c)];
    header.channels().insert(name, Imf::Channel(pixel));
    // The library takes a mutable pointer for reading and writing alike; it only reads here.
    planes.insert(name, Imf::Slice(pixel, const_cast<char*>(data + c * image.pixels() * size), size,
                                   size * static_cast<std::size_t>(image.width)));
  }
  MemoryStream stream(where);
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(planes);
    file.writePixels(image.height);
  }  // its destructor writes the table of lines
  return stream.bytes();
}

/// Pixels as 8-bit formats have them, channels side by side.
std::vector<unsigned char> codes_of(const Image& image, Encoding encoding, const std::string& where) {
  std::vector<unsigned char> codes(image.data.size());
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    const float value = image.data[i];
    if (!std::isfinite(value))
      throw Error(ErrorKind::Failed, "a value to write is not finite", where,
                  fmt::format("{} at {}", value, place_of(image, i)));
    const float v = std::clamp(value, 0.0f, 1.0f);
    const std::size_t to = i % image.pixels() * image.channels + i / image.pixels();
    codes[to] =
        static_cast<unsigned char>(std::lround(255 * (encoding == Encoding::Gamma ? std::pow(v, 1 / 2.2f) : v)));
  }
  return codes;
}

/// `format`: "png", or "jpeg" with its quality in `compression`.
std::string encode_8bit(const Image& image, const char* format, const std::string& compression, Encoding encoding,
                        const std::string& where) {
  check_to_write(image, where);
  if (image.channels != 1 && image.channels != 3)
    throw Error(ErrorKind::Failed, fmt::format("a {} has one or three channels", format), where,
                fmt::format("{}", image.channels));
  const std::vector<unsigned char> codes = codes_of(image, encoding, where);
  std::vector<unsigned char> buffer;
  OIIO::Filesystem::IOVecOutput proxy(buffer);
  const auto output = OIIO::ImageOutput::create(format);
  if (!output) throw Error(ErrorKind::Failed, fmt::format("no encoder for {}", format), where);
  output->set_ioproxy(&proxy);
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeUInt8);
  if (!compression.empty()) spec.attribute("Compression", compression);
  if (!output->open(where, spec) || !output->write_image(OIIO::TypeUInt8, codes.data()) || !output->close())
    throw Error(ErrorKind::Failed, "encoding failed: " + output->geterror(), where);
  return {buffer.begin(), buffer.end()};
}

}  // namespace

bool fits_half(const Image& image) {
  float largest = 0;
  for (const float v : image.data)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  return !overflows_half(largest) && (largest == 0 || largest >= kDark);
}

void write_exr(const std::filesystem::path& path, const Image& image, ExrType type, std::vector<std::string> names,
               const ExrText& text) {
  const std::string where = path.string();
  check_to_write(image, where);
  if (names.empty() && image.channels == 1) names = {"Y"};
  if (names.empty() && image.channels == 3) names = {"R", "G", "B"};
  if (static_cast<int>(names.size()) != image.channels)
    throw Error(ErrorKind::Failed, "one name per channel is needed", where, fmt::format("{} names", names.size()),
                fmt::format("{}", image.channels));
  std::string bytes;
  try {
    bytes = encode_exr(image, type, names, text, where);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorKind::Failed, std::string("encoding failed: ") + error.what(), where);
  }
  write_file(path, bytes);
}

std::string encode_png(const Image& image, Encoding encoding, const std::string& where) {
  return encode_8bit(image, "png", "", encoding, where);
}

std::string encode_jpeg(const Image& image, int quality, Encoding encoding, const std::string& where) {
  return encode_8bit(image, "jpeg", fmt::format("jpeg:{}", quality), encoding, where);
}

void write_png(const std::filesystem::path& path, const Image& image, Encoding encoding) {
  write_file(path, encode_png(image, encoding, path.string()));
}

}  // namespace clerestory
