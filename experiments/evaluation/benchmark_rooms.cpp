// Generated rooms: what the test scripts of Zhu et al., Li et al. and Marigold print of synthetic data.
#include <algorithm>
#include <cmath>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/evaluation/benchmark_errors.hpp"
#include "experiments/evaluation/whdr.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/image.hpp"
#include "host/io/openrooms.hpp"
#include "host/io/resize.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Values = std::vector<std::optional<double>>;

constexpr int kWidth = 320, kHeight = 240;  // of both test scripts

/// A view at the size of the scripts.
struct SmallView {
  Image albedo, normal, depth, material, geometry, reflecting, with_material;

  explicit SmallView(const RoomView& view)
      : albedo(resize_area(view.albedo, kWidth, kHeight)),
        normal(resize_nearest(view.normal, kWidth, kHeight)),
        depth(resize_nearest(view.depth, kWidth, kHeight)),
        material(resize_nearest(view.material, kWidth, kHeight)),
        geometry(resize_nearest(view.mask, kWidth, kHeight)),
        reflecting(geometry),
        with_material(geometry) {
    const Image emission = view.emission ? resize_nearest(*view.emission, kWidth, kHeight) : Image(kWidth, kHeight, 3);
    for (std::size_t i = 0; i < geometry.data.size(); ++i) {
      for (int c = 0; c < 3; ++c)
        if (emission.plane(c)[i] > 0) reflecting.data[i] = 0;
      if (material.plane(0)[i] == 0 && material.plane(1)[i] == 0) with_material.data[i] = 0;
    }
  }
};

Image multiplied(Image image, double factor) {
  scale(image.data, factor);
  return image;
}

Values judge_zhu(const SmallView& view, const PredictedMaps& maps) {
  Values values(5);
  if (maps.albedo) values[0] = masked_mse(resize_area(*maps.albedo, kWidth, kHeight), view.albedo, view.geometry);
  if (maps.normal) values[1] = masked_mse(resize_nearest(*maps.normal, kWidth, kHeight), view.normal, view.geometry);
  if (maps.material) {
    const Image ours = resize_nearest(*maps.material, kWidth, kHeight);
    for (int c = 0; c < 2; ++c)
      values[static_cast<std::size_t>(2 + c)] =
          masked_mse(channel(ours, c), channel(view.material, c), view.with_material);
  }
  if (maps.depth) {
    const double farthest = std::max<double>(*std::ranges::max_element(view.depth.data), 1e-6);
    values[4] = scaled_log_depth_error(resize_nearest(*maps.depth, kWidth, kHeight),
                                       multiplied(view.depth, 1 / farthest), view.geometry);
  }
  return values;
}

Values judge_li(const SmallView& view, const PredictedMaps& maps) {
  Values values(4);
  if (maps.albedo) {
    Image ours = resize_area(*maps.albedo, kWidth, kHeight);
    scale(ours.data, fitted_scale(ours, view.albedo, view.reflecting));
    for (float& v : ours.data) v = std::clamp(v, 0.0f, 1.0f);
    values[0] = masked_mse(ours, view.albedo, view.reflecting);
  }
  if (maps.normal) values[1] = masked_mse(resize_nearest(*maps.normal, kWidth, kHeight), view.normal, view.geometry);
  if (maps.material) {
    const auto coded = [](const Image& material) { return multiplied(channel(material, 0), 2); };
    values[2] =
        masked_mse(coded(resize_nearest(*maps.material, kWidth, kHeight)), coded(view.material), view.reflecting);
  }
  if (maps.depth)
    values[3] = scaled_log_depth_error(resize_nearest(*maps.depth, kWidth, kHeight), view.depth, view.geometry);
  return values;
}

/// Albedo as Marigold's script has it: display values at the size of the picture, every pixel.
Values judge_marigold(const Image& true_albedo, const PredictedMaps& maps) {
  if (!maps.albedo) return Values(3);
  const auto shown = [](Image albedo) {
    for (float& v : albedo.data) v = std::clamp(v, 0.0f, 1.0f);
    return display_coded(std::move(albedo));
  };
  const Image truth = shown(true_albedo);
  const Image ours = resize_bilinear(shown(*maps.albedo), truth.width, truth.height);
  return {psnr(ours, truth), ssim(ours, truth, Border::Mirrored), ssim(ours, truth, Border::LeftOut)};
}

const std::string kMasked = "mean over valid pixels and channels, then over views";

void describe_zhu(Benchmark& out) {
  out.metrics = {
      {"albedo_mse", "albedo, MSE", "", "linear, of no free scale; " + kMasked},
      {"normal_mse", "normals, MSE", "", "camera space, [-1, 1]; " + kMasked},
      {"roughness_mse", "roughness, MSE", "", "where roughness and metallic are not both 0; " + kMasked},
      {"metallic_mse", "metallic, MSE", "", "where roughness and metallic are not both 0; " + kMasked},
      {"depth_log_mse", "depth, log MSE", "",
       "ln(1 + s predicted) against ln(1 + true), true depth over its maximum in the view, s of least squares of depth "
       "within 0.001 and 1000; " +
           kMasked}};
  out.conventions.push_back(
      "as the released test script prints them; it averages over batches, here views count alike");
}

void describe_li(Benchmark& out) {
  out.metrics = {
      {"albedo_scaled_mse", "albedo, scaled MSE", "",
       "linear, one scale of least squares a view, then clamped to [0, 1], where nothing is emitted; " + kMasked},
      {"normal_mse", "normals, MSE", "", "camera space, [-1, 1], lamps too; " + kMasked},
      {"roughness_mse", "roughness, MSE", "", "of 2 r - 1, where nothing is emitted; " + kMasked},
      {"depth_log_mse", "depth, log MSE", "",
       "ln(1 + s predicted) against ln(1 + metres), s of least squares of depth within 0.001 and 1000, lamps too; " +
           kMasked}};
}

void describe_marigold(Benchmark& out) {
  out.metrics = {
      {"albedo_psnr_db", "albedo, PSNR", "dB", "of values up to 1, over all pixels and channels, mean over views"},
      {"albedo_ssim", "albedo, SSIM", "",
       "Gaussian window of 11 pixels and deviation 1.5, K1 0.01, K2 0.03, borders mirrored as in torchmetrics 1.6 to "
       "1.9, "
       "mean over channels and views"},
      {"albedo_ssim_inside", "albedo, SSIM without borders", "",
       "the same where the window lies inside, as in torchmetrics 1.3 and scikit-image"}};
  out.conventions = {
      "albedo clamped to [0, 1] and coded by v^(1/2.2), which the script calls sRGB; no free scale, no mask",
      "the script shows its method the picture at 640 pixels of the longer side, display values in 8 bits, and judges "
      "at "
      "the size of the file (InteriorVerse: 640x480); predictions are resized bilinearly to it as display values",
      "LPIPS and the material, which the script also prints, are not computed"};
}

/// Where the truth comes from: a view with these maps.
using ReadView = std::function<RoomView(std::size_t, const ViewParts&)>;

Benchmark benchmark_of(Protocol protocol, const ReadView& read) {
  Benchmark out;
  out.picture = [read](std::size_t i) {
    ViewParts picture{.mask = false, .albedo = false, .depth = false, .material = false};
    picture.normal = picture.emission = picture.camera = false;
    return read(i, picture).image;
  };
  if (protocol == Protocol::Marigold) {
    out.protocol = "marigold";
    describe_marigold(out);
    out.judge = [read](std::size_t i, const PredictedMaps& maps) {
      ViewParts albedo{.image = false, .mask = false, .depth = false, .material = false};
      albedo.normal = albedo.emission = albedo.camera = false;
      return BenchmarkFigures{judge_marigold(read(i, albedo).albedo, maps)};
    };
    return out;
  }
  const bool zhu = protocol == Protocol::Zhu;
  out.protocol = zhu ? "zhu" : "li";
  out.conventions = {fmt::format(
      "{}x{}: albedo averaged by area, all else nearest neighbour; valid: mask set, maps finite", kWidth, kHeight)};
  zhu ? describe_zhu(out) : describe_li(out);
  out.judge = [read, zhu](std::size_t i, const PredictedMaps& maps) {
    const SmallView view(read(i, ViewParts{.image = false}));
    return BenchmarkFigures{zhu ? judge_zhu(view, maps) : judge_li(view, maps)};
  };
  return out;
}

/// OpenRooms has no metals, and lamps by a mask.
RoomView as_room(OpenRoomsView from) {
  RoomView view;
  view.material = Image(from.image.width, from.image.height, 3);
  std::ranges::copy(from.roughness.data, view.material.data.begin());
  view.emission = Image(from.image.width, from.image.height, 3);
  view.mask = Image(from.image.width, from.image.height, 1);
  for (std::size_t i = 0; i < view.mask.data.size(); ++i) {
    view.mask.data[i] = from.mask.data[i] > 0.25f && from.depth.data[i] > 0 ? 1 : 0;
    view.emission->data[i] = from.mask.data[i] == 0.5f ? 1 : 0;
  }
  view.image = std::move(from.image), view.albedo = std::move(from.albedo), view.normal = std::move(from.normal);
  view.depth = std::move(from.depth);
  return view;
}

}  // namespace

Benchmark rooms_benchmark(Protocol protocol, const std::vector<fs::path>& views) {
  Benchmark out =
      benchmark_of(protocol, [views](std::size_t i, const ViewParts& parts) { return read_view(views[i], parts); });
  out.layout = "rooms";
  for (const fs::path& view : views)
    out.names.push_back(view.parent_path().filename().string() + "/" + view.filename().string());
  return out;
}

Benchmark openrooms_benchmark(Protocol protocol, const fs::path& data, const BenchmarkList& list) {
  if (protocol == Protocol::Zhu)
    throw usage_error("asks for metals, which OpenRooms does not have", "--protocol", "zhu", "li or marigold");
  if (!list.file.empty())
    throw usage_error("OpenRooms has lists of its own", "--list", list.file.string(), "--split NAME");
  const std::string split = list.split.empty() ? "test" : list.split;
  const std::vector<OpenRoomsName> views = list_openrooms(data, split);
  Benchmark out =
      benchmark_of(protocol, [views](std::size_t i, const ViewParts&) { return as_room(read_openrooms(views[i])); });
  out.layout = "openrooms";
  out.conventions.insert(out.conventions.begin(), "views: every kind of the scenes of " + split + ".txt");
  for (const OpenRoomsName& view : views) out.names.push_back(view.text());
  return out;
}

}  // namespace clerestory
