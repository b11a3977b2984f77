// Pictures: round trips, formats, channels, orientation, and what must not be read.
#include "host/io/image.hpp"

#include <OpenImageIO/imageio.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "host/io/files.hpp"
#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

/// What a code between 0 and 1 stands for.
float gamma_decoded(double code) { return static_cast<float>(std::pow(code, 2.2)); }

class Images : public Scratch {
 protected:
  // Writes with the library itself, as another program would.
  std::filesystem::path foreign(const std::string& name, OIIO::ImageSpec spec, const std::vector<float>& values) const {
    const auto path = folder / name;
    const auto output = OIIO::ImageOutput::create(path.string());
    EXPECT_TRUE(output && output->open(path.string(), spec) && output->write_image(OIIO::TypeFloat, values.data()) &&
                output->close())
        << name;
    return path;
  }
};

Image ramp(int width, int height, int channels) {
  Image image(width, height, channels);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.01f * static_cast<float>(i) + 0.1f;
  return image;
}

TEST_F(Images, ExrRoundTrips) {
  for (int channels : {1, 3}) {
    const Image image = ramp(7, 5, channels);
    write_exr(folder / "float.exr", image, ExrType::Float);
    const Image same = read_image(folder / "float.exr");
    EXPECT_EQ(same.width, 7);
    EXPECT_EQ(same.height, 5);
    EXPECT_EQ(same.channels, channels);
    EXPECT_EQ(same.data, image.data) << "float is exact";

    write_exr(folder / "half.exr", image, ExrType::Half);
    const Image near = read_image(folder / "half.exr");
    for (std::size_t i = 0; i < image.data.size(); ++i)  // half an ulp of an 11-bit significand
      EXPECT_NEAR(near.data[i], image.data[i], std::ldexp(image.data[i], -11));
  }
  EXPECT_EQ(entries(), 2u) << "no temporaries";
}

TEST_F(Images, ExrKeepsSpecialValues) {
  Image image(4, 1, 1);
  image.data = {HUGE_VALF, -HUGE_VALF, std::nanf(""), 65504};
  EXPECT_TRUE(fits_half(image));
  write_exr(folder / "a.exr", image, ExrType::Half);
  const Image same = read_image(folder / "a.exr");
  EXPECT_EQ(same.data[0], HUGE_VALF);
  EXPECT_EQ(same.data[1], -HUGE_VALF);
  EXPECT_TRUE(std::isnan(same.data[2]));
  EXPECT_EQ(same.data[3], 65504);
}

TEST_F(Images, HalfRefusesWhatDoesNotFit) {
  Image image(3, 2, 3, 1);
  image.at(1, 1, 2) = 70000;
  EXPECT_FALSE(fits_half(image));
  expect_error([&] { write_exr(folder / "a.exr", image); }, {"a.exr", "70000", "channel 1, pixel (2, 1)", "65504"},
               ErrorKind::Failed);
  EXPECT_EQ(entries(), 0u);
  EXPECT_NO_THROW(write_exr(folder / "a.exr", image, ExrType::Float));
}

TEST_F(Images, HalfIsTooCoarseForWhatIsDarkAllOver) {
  Image image(3, 2, 3, 1e-7f);
  EXPECT_FALSE(fits_half(image));
  image.at(1, 1, 2) = 1e-2f;
  EXPECT_TRUE(fits_half(image));
  EXPECT_TRUE(fits_half(Image(3, 2, 3, 0)));
}

TEST_F(Images, EqualContentGivesEqualBytes) {
  write_exr(folder / "a.exr", ramp(20, 10, 3));
  write_exr(folder / "b.exr", ramp(20, 10, 3));
  EXPECT_EQ(get(folder / "a.exr"), get(folder / "b.exr"));
  for (const char* date : {"capDate", "DateTime"})
    EXPECT_EQ(get(folder / "a.exr").find(date), std::string::npos) << date;
  EXPECT_EQ(encode_png(ramp(20, 10, 3), Encoding::Gamma, "a"), encode_png(ramp(20, 10, 3), Encoding::Gamma, "b"));
}

TEST_F(Images, ExrHeader) {
  write_exr(folder / "a.exr", ramp(4, 2, 1), ExrType::Float, {}, {{"clerestory:seed", "7"}});
  const auto input = OIIO::ImageInput::open((folder / "a.exr").string());
  ASSERT_TRUE(input);
  EXPECT_EQ(input->spec().channelnames, std::vector<std::string>{"Y"});
  EXPECT_EQ(input->spec().get_string_attribute("clerestory:seed"), "7");
  write_exr(folder / "b.exr", ramp(4, 2, 3));
  const auto colour = OIIO::ImageInput::open((folder / "b.exr").string());
  EXPECT_EQ(colour->spec().channelnames, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(colour->spec().format, OIIO::TypeHalf);
  expect_error([&] { write_exr(folder / "c.exr", ramp(2, 2, 2)); }, {"c.exr", "name per channel"}, ErrorKind::Failed);
  expect_error([&] { write_exr(folder / "c.exr", Image()); }, {"c.exr", "empty"}, ErrorKind::Failed);
}

// All 256 codes survive; v * (1/255) and v / 255 may differ in the last place.
void expect_codes(const Image& found, const Image& expected) {
  ASSERT_EQ(found.data.size(), expected.data.size());
  for (std::size_t i = 0; i < found.data.size(); ++i) EXPECT_FLOAT_EQ(found.data[i], expected.data[i]);
}

TEST_F(Images, PngRoundTrips) {
  Image image(256, 1, 3);
  for (int c = 0; c < 3; ++c)
    for (int v = 0; v < 256; ++v) image.at(c, 0, v) = static_cast<float>(v) / 255;
  write_png(folder / "linear.png", image, Encoding::Linear);
  expect_codes(read_image(folder / "linear.png"), image);

  // A photograph written as preview comes back: v -> v^2.2 -> code v.
  const Photo photo = read_photo(folder / "linear.png");
  write_png(folder / "gamma.png", photo.image, Encoding::Gamma);
  expect_codes(read_image(folder / "gamma.png"), image);

  Image outside(2, 1, 1);
  outside.data = {-3, 7};
  write_png(folder / "clamped.png", outside);
  EXPECT_EQ(read_image(folder / "clamped.png").data, (std::vector<float>{0, 1}));
  outside.data = {0, std::nanf("")};
  expect_error([&] { write_png(folder / "nan.png", outside); }, {"nan.png", "pixel (1, 0)"}, ErrorKind::Failed);
  expect_error([&] { write_png(folder / "two.png", Image(1, 1, 2)); }, {"one or three"}, ErrorKind::Failed);
}

TEST_F(Images, PhotographOfEightBits) {
  const Photo photo = read_photo(asset("real/coffee/rgb.png"));
  EXPECT_EQ(photo.encoding, Encoding::Gamma);
  EXPECT_EQ(photo.image.width, 600);
  EXPECT_EQ(photo.image.height, 400);
  EXPECT_NE(photo.note.find("8-bit PNG"), std::string::npos) << photo.note;
  EXPECT_NE(photo.note.find("2.2"), std::string::npos) << photo.note;
  // Bytes from an independent decoder of the same file.
  struct Known {
    int x, y, rgb[3];
  };
  for (const Known& k :
       {Known{0, 0, {21, 13, 8}}, {599, 0, {228, 184, 140}}, {0, 399, {197, 141, 100}}, {123, 45, {167, 64, 20}}})
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(photo.image.at(c, k.y, k.x), gamma_decoded(k.rgb[c] / 255.0));
}

TEST_F(Images, PhotographsOfOtherKinds) {
  const Photo exr = read_photo(asset("hdri/lab.exr"));
  EXPECT_EQ(exr.encoding, Encoding::Linear);
  EXPECT_EQ(exr.image.channels, 3);
  EXPECT_NE(exr.note.find("as it is"), std::string::npos);

  OIIO::ImageSpec grey(3, 2, 1, OIIO::TypeUInt16);
  const Photo photo = read_photo(foreign("grey.png", grey, {0, 0.25f, 0.5f, 0.75f, 1, 0.1f}));
  ASSERT_EQ(photo.image.channels, 3);
  EXPECT_NE(photo.note.find("16-bit PNG"), std::string::npos) << photo.note;
  EXPECT_NE(photo.note.find("grey"), std::string::npos) << photo.note;
  for (int c = 0; c < 3; ++c)  // 16-bit codes: half a step of 1/65535 times a slope below 2.2
    EXPECT_NEAR(photo.image.at(c, 0, 2), gamma_decoded(0.5), 0.5 * 2.2 / 65535);

  const Photo hdr = read_photo(foreign("a.hdr", OIIO::ImageSpec(16, 2, 3, OIIO::TypeFloat), std::vector<float>(96, 5)));
  EXPECT_EQ(hdr.encoding, Encoding::Linear);
  EXPECT_EQ(hdr.image.at(1, 1, 7), 5) << "8 bits of significand hold it";

  const Photo jpeg =
      read_photo(foreign("a.jpg", OIIO::ImageSpec(16, 16, 3, OIIO::TypeUInt8), std::vector<float>(768, 0.5f)));
  EXPECT_EQ(jpeg.encoding, Encoding::Gamma);
  // One of 255 codes for the quantised mean of a block, one for the colours: times the slope 2.2 * 0.5^1.2 = 0.96.
  EXPECT_NEAR(jpeg.image.at(0, 3, 3), gamma_decoded(0.5), 2 * 0.96 / 255);

  OIIO::ImageSpec two(2, 2, 2, OIIO::TypeHalf);
  two.channelnames = {"u", "v"};
  two.alpha_channel = -1;
  expect_error([&] { read_photo(foreign("two.exr", two, std::vector<float>(8))); }, {"two.exr", "2: u, v"});
}

TEST_F(Images, AlphaIsDroppedAndDoesNotScale) {
  OIIO::ImageSpec spec(2, 1, 4, OIIO::TypeUInt8);
  spec["oiio:UnassociatedAlpha"] = 1;
  const Photo photo = read_photo(foreign("a.png", spec, {1, 0.6f, 0.2f, 0, 0.2f, 0.6f, 1, 0.4f}));
  ASSERT_EQ(photo.image.channels, 3);
  EXPECT_NE(photo.note.find("alpha dropped"), std::string::npos) << photo.note;
  EXPECT_FLOAT_EQ(photo.image.at(1, 0, 1), gamma_decoded(0.6));
  EXPECT_EQ(photo.image.at(0, 0, 0), 1) << "colour under alpha 0 survives";

  OIIO::ImageSpec grey(1, 1, 2, OIIO::TypeUInt8);
  grey.channelnames = {"Y", "A"};
  grey.alpha_channel = 1;
  grey["oiio:UnassociatedAlpha"] = 1;
  EXPECT_EQ(read_image(foreign("grey.png", grey, {1, 0.2f})).channels, 1);
}

TEST_F(Images, StrayBytesOfAJpegDoNotHideItsEnd) {
  const std::string whole = get(std::filesystem::path(CLERESTORY_SOURCE_DIR) / "tests/data/io/ramp.jpg");
  std::string stray = whole;
  stray.insert(whole.find("\xff\xdb"), 1, '\0');
  const Image same = read_image(put("stray.jpg", stray));
  EXPECT_EQ(same.data, read_image(put("whole.jpg", whole)).data);
  for (const std::string& bytes : {whole, stray})
    expect_error([&] { read_image(put("cut.jpg", bytes.substr(0, bytes.size() - 40))); }, {"cut.jpg", "JPEG"});
}

TEST_F(Images, OrientationOfJpegIsApplied) {
  // 16 x 8, left half bright: where it lands tells the turn. Blocks are flat, so compression keeps them.
  std::vector<float> values;
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x) values.insert(values.end(), 3, x < 8 ? 1.0f : 0.0f);
  struct Turn {
    int orientation, width, height, bright_x, bright_y;
  };
  for (const Turn& t : {Turn{1, 16, 8, 0, 0},
                        {2, 16, 8, 15, 0},
                        {3, 16, 8, 15, 7},
                        {4, 16, 8, 0, 7},
                        {5, 8, 16, 0, 0},
                        {6, 8, 16, 7, 0},
                        {7, 8, 16, 7, 15},
                        {8, 8, 16, 0, 15}}) {
    OIIO::ImageSpec spec(16, 8, 3, OIIO::TypeUInt8);
    spec["Orientation"] = t.orientation;
    spec["jpeg:subsampling"] = "4:4:4";
    const Image image = read_image(foreign("o.jpg", spec, values));
    ASSERT_EQ(image.width, t.width) << t.orientation;
    ASSERT_EQ(image.height, t.height) << t.orientation;
    EXPECT_GT(image.at(0, t.bright_y, t.bright_x), 0.9f) << t.orientation;
    EXPECT_LT(image.at(0, image.height - 1 - t.bright_y, image.width - 1 - t.bright_x), 0.1f) << t.orientation;
  }
}

TEST_F(Images, FocalLengthOfAPhotographIsThatOfItsExif) {
  struct Lens {
    std::vector<std::pair<const char*, float>> said;
    double focal;  // pixels of a picture of 64 x 48, whose diagonal is 80
  };
  for (const auto& [said, focal] : {
           Lens{{}, 0},
           {{{"Exif:FocalLength", 4.2f}}, 0},  // of which sensor it does not say
           {{{"Exif:FocalLengthIn35mmFilm", 26}}, 26 * 80 / std::hypot(36.0, 24.0)},
           {{{"Exif:FocalLengthIn35mmFilm", 0}}, 0},
           {{{"Exif:FocalLength", 10}, {"Exif:FocalPlaneXResolution", 254}}, 100},  // pixels an inch
           {{{"Exif:FocalLength", 10}, {"Exif:FocalPlaneXResolution", 100}, {"Exif:FocalPlaneResolutionUnit", 3}}, 100},
           {{{"Exif:FocalLength", 10}, {"Exif:FocalPlaneXResolution", 254}, {"Exif:PixelXDimension", 640}}, 10},
           {{{"Exif:FocalLengthIn35mmFilm", 26}, {"Exif:FocalLength", 10}, {"Exif:FocalPlaneXResolution", 254}},
            26 * 80 / std::hypot(36.0, 24.0)},
       }) {
    OIIO::ImageSpec spec(64, 48, 3, OIIO::TypeUInt8);
    spec["Orientation"] = 6;  // turning a picture turns no lens
    for (const auto& [name, value] : said) {
      const std::string key = name;
      if (key == "Exif:FocalLength" || key == "Exif:FocalPlaneXResolution")
        spec[name] = value;
      else
        spec[name] = static_cast<int>(value);
    }
    const Photo photo = read_photo(foreign("lens.jpg", spec, std::vector<float>(64 * 48 * 3, 0.5f)));
    EXPECT_EQ(photo.image.width, 48);
    EXPECT_DOUBLE_EQ(photo.focal, focal) << (said.empty() ? "" : said[0].first);
  }
}

// All eight, pixel by pixel, on the smallest picture without symmetry. By EXIF's definition the stored top row is the
// visual top, top, bottom, bottom, left, right, right, left side.
TEST_F(Images, OrientationOfEveryPixel) {
  const std::vector<float> stored{0, 0.2f, 0.4f, 0.6f, 0.8f, 1};  // 3 x 2: a b c / d e f
  const std::vector<std::vector<float>> upright{{0, 0.2f, 0.4f, 0.6f, 0.8f, 1}, {0.4f, 0.2f, 0, 1, 0.8f, 0.6f},
                                                {1, 0.8f, 0.6f, 0.4f, 0.2f, 0}, {0.6f, 0.8f, 1, 0, 0.2f, 0.4f},
                                                {0, 0.6f, 0.2f, 0.8f, 0.4f, 1}, {0.6f, 0, 0.8f, 0.2f, 1, 0.4f},
                                                {1, 0.4f, 0.8f, 0.2f, 0.6f, 0}, {0.4f, 1, 0.2f, 0.8f, 0, 0.6f}};
  for (int o = 1; o <= 8; ++o) {
    OIIO::ImageSpec spec(3, 2, 1, OIIO::TypeUInt8);
    spec["Orientation"] = o;
    const auto path = foreign(
        "o.exr",
        [&] {
          auto s = spec;
          s.set_format(OIIO::TypeFloat);
          return s;
        }(),
        stored);
    const Image image = read_image(path);
    EXPECT_EQ(image.width, o < 5 ? 3 : 2) << o;
    EXPECT_EQ(image.data, upright[static_cast<std::size_t>(o - 1)]) << o;
  }
}

// By Radiance's definition: the first axis is that of the scanlines, X grows to the right and Y upwards.
TEST_F(Images, OrientationOfRadianceFiles) {
  const int width = 3, height = 2;
  const auto value = [&](int x, int y) { return 1 << (width * y + x); };  // exact in 8 bits and an exponent
  for (const bool by_columns : {false, true})
    for (const bool x_grows : {false, true})
      for (const bool y_grows : {false, true}) {
        const std::string x_axis = fmt::format("{}X {}", x_grows ? '+' : '-', width),
                          y_axis = fmt::format("{}Y {}", y_grows ? '+' : '-', height);
        const std::string axes = by_columns ? x_axis + " " + y_axis : y_axis + " " + x_axis;
        const auto path = folder / "o.hdr";
        std::ofstream out(path, std::ios::binary);
        out << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" << axes << "\n";
        for (int i = 0; i < width * height; ++i) {
          const int along_x = by_columns ? i / height : i % width, along_y = by_columns ? i % height : i / width;
          const int x = x_grows ? along_x : width - 1 - along_x, y = y_grows ? height - 1 - along_y : along_y;
          const char mantissa = char(128), exponent = char(129 + width * y + x);  // v = 128 / 256 * 2^(e - 128)
          out << mantissa << mantissa << mantissa << exponent;
        }
        out.close();
        const Image image = read_image(path);
        ASSERT_EQ(image.width, width) << axes;
        for (int y = 0; y < height; ++y)
          for (int x = 0; x < width; ++x) EXPECT_NEAR(image.at(0, y, x) / value(x, y), 1, 0.01) << axes;
      }
}

// Of a size that blocks of 16 do not divide: the rest of a block is nobody's.
TEST_F(Images, AJpegInMemoryKeepsWhatItsQualitySays) {
  Image picture(37, 29, 3);
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < 29; ++y)
      for (int x = 0; x < 37; ++x)
        picture.at(c, y, x) = 0.2f + 0.012f * static_cast<float>(x) + 0.004f * static_cast<float>(y * (c + 1));
  const auto error = [&](int quality) {
    const Image read = decode_image(encode_jpeg(picture, quality, Encoding::Linear, "a.jpg"), "a.jpg");
    EXPECT_EQ(read.width, 37);
    EXPECT_EQ(read.height, 29);
    double sum = 0;
    for (std::size_t i = 0; i < picture.data.size(); ++i)
      sum += std::pow(static_cast<double>(read.data[i]) - static_cast<double>(picture.data[i]), 2);
    return std::sqrt(sum / static_cast<double>(picture.data.size()));
  };
  EXPECT_LT(error(100), 3.0 / 255) << "colours at half the size, and the rounding of two transforms";
  EXPECT_GT(error(5), 2 * error(95));
  const Image grey = decode_image(encode_jpeg(Image(9, 7, 1, 0.5f), 90, Encoding::Linear, "g.jpg"), "g.jpg");
  EXPECT_EQ(grey.channels, 1);
  for (const float v : grey.data) EXPECT_NEAR(v, 0.5, 1.5 / 255);
  expect_error([&] { decode_image(encode_jpeg(picture, 90, Encoding::Linear, "a").substr(0, 400), "half"); },
               {"half", "Premature end"});
}

TEST_F(Images, APartOfAPictureIsRefused) {
  OIIO::ImageSpec part(2, 2, 3, OIIO::TypeFloat);
  part.x = 1, part.y = 1, part.full_width = 4, part.full_height = 3;
  expect_error([&] { read_photo(foreign("part.exr", part, std::vector<float>(12, 0.5f))); },
               {"part.exr", "display window", "2x2", "4x3"});
}

TEST_F(Images, MapsByChannelCount) {
  OIIO::ImageSpec odd(2, 2, 1, OIIO::TypeFloat);
  odd.channelnames = {"distance.whatever"};
  EXPECT_EQ(read_map(foreign("odd.exr", odd, {1, 2, 3, 4}), 1).data, (std::vector<float>{1, 2, 3, 4}));

  OIIO::ImageSpec alpha(1, 1, 1, OIIO::TypeFloat);
  alpha.channelnames = {"A"};  // the only channel, whatever its name
  EXPECT_EQ(read_map(foreign("alpha.exr", alpha, {0.5f}), 1).data, std::vector<float>{0.5f});

  OIIO::ImageSpec many(1, 1, 5, OIIO::TypeFloat);
  many.channelnames = {"B", "G", "R", "Y", "Z"};
  many.alpha_channel = -1;
  const auto path = foreign("many.exr", many, {1, 2, 3, 4, 5});
  EXPECT_EQ(read_map(path, 3).data, (std::vector<float>{3, 2, 1})) << "R, G, B by name";

  OIIO::ImageSpec layers(1, 1, 3, OIIO::TypeFloat);
  layers.channelnames = {"Y", "U", "W"};
  layers.alpha_channel = -1;
  EXPECT_EQ(read_map(foreign("layers.exr", layers, {4, 5, 6}), 1).data, std::vector<float>{4});

  expect_error([&] { read_map(asset("real/office/depth.exr"), 3); }, {"depth.exr", "1: Y", "R, G, B"});
  expect_error([&] { read_map(asset("hdri/lab.exr"), 1); }, {"lab.exr", "3: R, G, B", "1, or one named Y"});
}

TEST_F(Images, RadianceMustBeFinite) {
  for (float bad : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
    Image image(5, 4, 3, 1);
    image.at(0, 3, 0) = bad;  // first in the first plane
    image.at(2, 1, 4) = bad;  // first in reading order
    expect_error([&] { check_radiance(image, "x.exr"); }, {"x.exr", "channel 2, pixel (4, 1)"});
    write_exr(folder / "bad.exr", image, ExrType::Float);
    expect_error([&] { read_photo(folder / "bad.exr"); }, {"bad.exr", "not finite"});
  }
}

TEST_F(Images, NegativeRadianceIsClampedAndCounted) {
  const auto path = asset("hdri/apartment.exr");
  const Image raw = read_image(path);
  std::uint64_t negative = 0;
  float least = 0;
  for (float v : raw.data) negative += v < 0, least = std::min(least, v);
  EXPECT_LT(least, -0.5f) << "the panorama rings, as its README says";
  const Photo photo = read_photo(path);
  EXPECT_EQ(photo.clamped, negative);
  EXPECT_GT(negative, 0u);
  EXPECT_NE(photo.note.find(std::to_string(negative) + " negative"), std::string::npos) << photo.note;
  for (std::size_t i = 0; i < raw.data.size(); ++i) ASSERT_EQ(photo.image.data[i], std::max(raw.data[i], 0.0f));
}

}  // namespace
}  // namespace clerestory
