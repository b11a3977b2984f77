#include "experiments/evaluation/prepare.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

void check_size(int width, int height) {
  if (width < 1 || height < 1)
    throw Error(ErrorKind::Failed, "a size must be positive", "resize", fmt::format("{}x{}", width, height));
}

}  // namespace

Image window(const Image& image, int left, int top, int width, int height) {
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < height; ++y)
      std::copy_n(image.plane(c) + static_cast<std::size_t>(top + y) * image.width + left, width,
                  out.plane(c) + static_cast<std::size_t>(y) * width);
  return out;
}

Image crop_to_aspect(const Image& image, int width, int height) {
  check_size(width, height);
  const double wanted = static_cast<double>(width) / height;
  const int w = std::clamp(static_cast<int>(std::lround(image.height * wanted)), 1, image.width);
  const int h = std::clamp(static_cast<int>(std::lround(image.width / wanted)), 1, image.height);
  if (w == image.width && h == image.height) return image;
  return window(image, (image.width - w) / 2, (image.height - h) / 2, w, h);
}

Image pad_to_multiple(const Image& image, int multiple, bool repeat) {
  const int width = (image.width + multiple - 1) / multiple * multiple;
  const int height = (image.height + multiple - 1) / multiple * multiple;
  if (width == image.width && height == image.height) return image;
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        if (repeat || (x < image.width && y < image.height))
          out.at(c, y, x) = image.at(c, std::min(y, image.height - 1), std::min(x, image.width - 1));
  return out;
}

Image mirrored(const Image& image) {
  Image out = image;
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < image.height; ++y) {
      float* row = out.plane(c) + static_cast<std::size_t>(y) * image.width;
      std::reverse(row, row + image.width);
    }
  return out;
}

Image mirrored_normals(const Image& normal) {
  Image out = mirrored(normal);
  for (std::size_t i = 0; i < out.pixels(); ++i) out.plane(0)[i] = -out.plane(0)[i];
  return out;
}

Image cut(const Image& image, int width, int height) {
  if (width > image.width || height > image.height)
    throw Error(ErrorKind::Failed, "a cut is larger than its picture", "cut", fmt::format("{}x{}", width, height),
                fmt::format("at most {}x{}", image.width, image.height));
  if (width == image.width && height == image.height) return image;
  return window(image, 0, 0, width, height);
}

RoomView centre_of(const RoomView& view, int width, int height) {
  RoomView out = view;
  const int left = (view.image.width - width) / 2, top = (view.image.height - height) / 2;
  for (Image* map : {&out.image, &out.mask, &out.albedo, &out.depth, &out.material, &out.normal})
    *map = window(*map, left, top, width, height);
  if (out.emission) out.emission = window(*out.emission, left, top, width, height);
  if (out.camera) {
    out.camera->cx -= left, out.camera->cy -= top;
    out.camera->width = width, out.camera->height = height;
  }
  return out;
}

PreparedView prepare_view(const RoomView& view, int width, int height) {
  const auto fit = [&](const Image& image, bool area) {
    const Image cropped = crop_to_aspect(image, width, height);
    return area ? resize_area(cropped, width, height) : resize_nearest(cropped, width, height);
  };
  PreparedView out;
  const float exposure = static_cast<float>(exposure_of(view.image.data));
  out.image = fit(view.image, true);
  scale(out.image.data, exposure);

  if (view.camera) {
    Camera cropped = *view.camera;
    const Image middle = crop_to_aspect(view.mask, width, height);
    cropped.cx -= (cropped.width - middle.width) / 2, cropped.cy -= (cropped.height - middle.height) / 2;
    cropped.width = middle.width, cropped.height = middle.height;
    out.camera = cropped.resized(width, height);
  }

  std::vector<float> depths;
  for (std::size_t i = 0; i < view.depth.pixels(); ++i)
    if (view.mask.data[i] > 0.5f && view.depth.data[i] > 0) depths.push_back(view.depth.data[i]);
  const bool known =
      static_cast<double>(depths.size()) >= std::max(1.0, least_valid_share * static_cast<double>(view.depth.pixels()));
  if (known) out.scene_scale = scene_scale(depths);

  out.truth = {fit(view.albedo, true), fit(view.normal, false), fit(view.depth, false), Image(width, height, 2)};
  const Image mask = fit(view.mask, false), material = fit(view.material, false);
  std::copy_n(material.data.begin(), out.truth.material.data.size(), out.truth.material.data.begin());
  out.masks = {Image(width, height, 1), Image(width, height, 1), Image(width, height, 1)};
  const Image emission = view.emission ? fit(*view.emission, false) : Image(width, height, 3);
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    const bool valid = known && mask.data[i] > 0.5f && out.truth.depth.data[i] > 0;
    const bool emits = emission.plane(0)[i] > 0 || emission.plane(1)[i] > 0 || emission.plane(2)[i] > 0;
    const bool has_material = material.plane(0)[i] != 0 || material.plane(1)[i] != 0;
    out.masks.geometry.data[i] = valid;
    out.masks.albedo.data[i] = valid && !emits;
    out.masks.material.data[i] = valid && has_material;
    float& depth = out.truth.depth.data[i];
    depth = valid ? depth / static_cast<float>(out.scene_scale) : 0.0f;
  }
  return out;
}

Image net_input(const Image& image, double gain) {
  Image fed = image;
  for (float& v : fed.data) v = std::clamp(v * static_cast<float>(gain), 0.0f, 1.0f);
  return pad_to_multiple(fed, net_multiple, true);
}

Image prepare_photo(const Image& linear, int longer, double* exposure) {
  const double factor = exposure_of(linear.data);
  if (exposure) *exposure = factor;
  const Size size = net_size(linear.width, linear.height, longer);
  Image image = resize_area(linear, size.width, size.height);
  scale(image.data, static_cast<float>(factor));
  return image;
}

}  // namespace clerestory
