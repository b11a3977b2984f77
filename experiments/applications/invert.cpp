#include "experiments/applications/invert.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <tuple>

#include "experiments/applications/chunk_progress.hpp"
#include "experiments/applications/estimate.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/mask.hpp"
#include "experiments/applications/predict.hpp"
#include "experiments/applications/render_record.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/applications/samples_record.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/cl/ceilings.hpp"
#include "host/cl/tile.hpp"
#include "host/error.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/own_files.hpp"
#include "host/report/progress.hpp"
#include "host/report/staged_folder.hpp"
#include "host/stopwatch.hpp"
#include "nets/known_lamps.hpp"
#include "nets/learned_light.hpp"
#include "nets/scene_maps.hpp"
#include "nets/scene_traits.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

bool wanted(const InvertOptions& options, const std::string& map) {
  return options.only.empty() || std::find(options.only.begin(), options.only.end(), map) != options.only.end();
}

void check_options(const InvertOptions& options) {
  static const std::vector<std::string> maps{"albedo", "normal", "depth", "material"};
  for (const std::string& name : options.only)
    if (std::find(maps.begin(), maps.end(), name) == maps.end())
      throw usage_error("there is no such map", "--only", name, "albedo, normal, depth or material");
  if (options.depth_scale && options.known)
    throw usage_error("two ways to set the scale of depth", "--depth-scale and --known", "both", "one of them");
  if (options.depth_scale && !(*options.depth_scale > 0 && *options.depth_scale < 1e4))
    throw usage_error("not a length", "--depth-scale", fmt::format("{}", *options.depth_scale),
                      "metres between 0 and 10000");
  if ((options.depth_scale || options.known) && !wanted(options, "depth"))
    throw usage_error("--only leaves out the depth, whose scale this sets", options.known ? "--known" : "--depth-scale",
                      "beside --only", "one of them, or depth among the maps");
  if (options.goal && !options.only.empty())
    throw usage_error("--only leaves out the re-render, whose error this is", "--target-error, --seconds",
                      "beside --only", "one of them");
  if (options.goal) check_goal(options.render, *options.goal);
  if (!options.mask.empty() && !options.goal)
    throw usage_error("there is no error to be measured under it", "--mask", "alone",
                      "--target-error or --seconds beside it");
  if (options.measure && !options.only.empty())
    throw usage_error("--only leaves out the re-render, which this times", "--measure", "beside --only", "one of them");
  if (options.measure && options.render.leave_out.empty())
    throw usage_error("nothing is left out, so that nothing is saved", "--measure", "beside --everything",
                      "one of them");
  if (options.fov && !options.camera.empty())
    throw usage_error("two ways to set the camera", "--fov and --camera", "both", "one of them");
}

/// What is to be said of a camera whose picture has other proportions: pixels of neither could be square, by more than
/// the rounding of a size to whole pixels.
std::string other_proportions(const Camera& camera, int width, int height) {
  const double wide = static_cast<double>(camera.width) * height / camera.height,
               high = static_cast<double>(camera.height) * width / camera.width;
  if (std::abs(wide - width) < 1 || std::abs(high - height) < 1) return {};
  return fmt::format(
      "it is of a picture of {}x{}, the photograph of {}x{} has other proportions: it is stretched, which is wrong for "
      "a "
      "picture that was cropped",
      camera.width, camera.height, width, height);
}

constexpr double kLeastFov = 5, kMostFov = 170;  // degrees: what else EXIF says of a lens is a mistake

/// Horizontal angle as EXIF says, degrees; 0 where it does not.
double fov_of(const Photo& photo) {
  return photo.focal > 0 ? 2 * std::atan(photo.image.width / (2 * photo.focal)) * 180 / std::numbers::pi : 0;
}

/// The camera from --camera, --fov, the G-buffer's own, the photograph's EXIF, or the default angle, in this order; and
/// where it came from, with all that is assumed or wrong.
std::pair<Camera, std::string> choose_camera(const InvertOptions& options, const GBuffer& given, const Photo& photo) {
  const int width = photo.image.width, height = photo.image.height;
  std::vector<std::string> notes;
  const auto resized = [&](const Camera& camera) {
    if (std::string note = other_proportions(camera, width, height); !note.empty()) notes.push_back(std::move(note));
    return camera.resized(width, height);
  };
  const auto of_file = [&](const CameraFile& file, const std::filesystem::path& name) {
    notes.push_back(name.string());
    const Camera camera = resized(file.camera);
    if (!file.has_pose) notes.push_back("no camera_to_world in the file, a level camera is assumed");
    if (file.integer_centres) notes.push_back("an RGB-D file: half a pixel is added to cx and cy");
    if (file.distortion) notes.push_back("lens distortion is known but not removed");
    return camera;
  };
  Camera camera;
  if (!options.camera.empty()) {
    camera = of_file(read_camera(options.camera), options.camera);
  } else if (options.fov) {
    camera = Camera::from_fov(width, height, options.fov);
    notes = {fmt::format("--fov {:g}", *options.fov), "a level camera is assumed"};
  } else if (given.camera) {
    camera = of_file(*given.camera, options.gbuffer);
  } else if (const double fov = fov_of(photo); fov >= kLeastFov && fov <= kMostFov) {
    camera = Camera::from_fov(width, height, fov);
    notes = {fmt::format("{:.1f} degrees across, as the photograph's EXIF says of a picture that is not cropped", fov),
             "a level camera is assumed"};
  } else {
    camera = Camera::from_fov(width, height);
    notes = {"no --fov and no --camera, 65 degrees across the longer side and a level camera are assumed"};
  }
  return {camera, fmt::format("{}", fmt::join(notes, "; "))};
}

void require_size(const std::optional<Image>& map, const std::string& name, const InvertOptions& options,
                  const Image& photo) {
  if (!map || (map->width == photo.width && map->height == photo.height)) return;
  throw usage_error("the map '" + name + "' has another size than the photograph", options.gbuffer.string(),
                    fmt::format("{}x{}", map->width, map->height), fmt::format("{}x{}", photo.width, photo.height));
}

void check_known(const KnownDepth& known, const Image& photo) {
  if (!(known.x >= 0 && known.y >= 0 && known.x < photo.width && known.y < photo.height))
    throw usage_error("the point lies outside of the picture", "--known", fmt::format("{:g},{:g}", known.x, known.y),
                      fmt::format("0..{},0..{}", photo.width - 1, photo.height - 1));
  if (!(known.metres > 0))
    throw usage_error("not a distance", "--known", fmt::format("{:g}", known.metres), "metres above 0");
}

constexpr double kLeastRoom = 0.01, kMostRoom = 1e3;  // metres, from a doll's house to a hall

/// Metres from relative depth, and where the scale came from.
std::string scale_depth(const InvertOptions& options, Image& depth, const Prediction& prediction) {
  const double p99 = scene_scale(depth.data, "predicted depth");
  double factor = 0;
  std::string how;
  if (options.known) {
    const int x = static_cast<int>(options.known->x), y = static_cast<int>(options.known->y);
    if (!(depth.at(0, y, x) > 0))
      throw usage_error("no depth was predicted there", "--known", fmt::format("{},{}", x, y), "a pixel with a depth");
    factor = options.known->metres / static_cast<double>(depth.at(0, y, x));
    how = fmt::format("{} m at pixel {},{} (--known)", options.known->metres, x, y);
  } else if (options.depth_scale) {
    factor = *options.depth_scale / p99;
    how = "--depth-scale";
  } else {
    factor = prediction.scene_scale / p99;
    how = fmt::format("{}, {}; --known X,Y,METRES sets it", kPredictedScale, prediction.off_by);
  }
  if ((options.known || options.depth_scale) && !(factor * p99 >= kLeastRoom && factor * p99 <= kMostRoom))
    throw usage_error("no room is as deep as that", options.known ? "--known" : "--depth-scale",
                      fmt::format("{:g} m at the 99th percentile", factor * p99),
                      fmt::format("{:g} to {:g} metres", kLeastRoom, kMostRoom));
  for (float& d : depth.data) d = static_cast<float>(d * factor);
  return fmt::format("{:.2f} m at the 99th percentile, {}", factor * p99, how);
}

/// Parts of the re-render as people think of them, by where their kernels lie. The rest is shading.
std::string part_of(const std::string& kernel) {
  static const std::vector<std::pair<std::string, std::string>> parts{
      {"nn/", "light's networks"},         {"tensor/resize", "light's networks"},      {"light/ssrt", "SSRT"},
      {"light/depth_pyramid", "SSRT"},     {"light/normal_pyramid", "SSRT"},           {"light/ask_mlp", "in-view MLP"},
      {"light/pixel_rows", "in-view MLP"}, {"light/direction_grid", "in-view MLP"},    {"light/ask_", "out of view"},
      {"light/soft_lamps", "lamps"},       {"light/project_rays", "light's networks"},
  };
  for (const auto& [prefix, part] : parts)
    if (kernel.starts_with(prefix)) return part;
  return "shading";
}

/// "8.2 million rays, 0.9 TFLOP; 2.9 s predicted, 3.1 s measured".
std::string saved_text(const Saved& saved, std::optional<double> measured) {
  std::vector<std::string> parts;
  if (saved.rays > 0) parts.push_back(fmt::format("{:.1f} million rays", saved.rays * 1e-6));
  if (saved.flops > 0) parts.push_back(fmt::format("{:.2f} TFLOP", saved.flops * 1e-12));
  std::vector<std::string> seconds{fmt::format("{:.1f} s predicted", saved.predicted)};
  if (measured) seconds.push_back(fmt::format("{:.1f} s measured", *measured));
  parts.push_back(fmt::format("{}", fmt::join(seconds, ", ")));
  return fmt::format("{}", fmt::join(parts, "; "));
}

/// What the scene has, and what was left out for what it lacks.
void record_savings(const SceneTraits& traits, const std::vector<Saved>& all, const std::map<Saving, double>& measured,
                    const RenderSettings& settings, Provenance& record) {
  record.facts["scene"] = describe(traits);
  if (settings.leave_out.empty()) record.facts["left out"] = "nothing, as --everything says";
  for (const Saved& saved : all) {
    const SavingKind& kind = kind_of(saved.saving);
    const auto found = measured.find(saved.saving);
    const std::optional<double> seconds = found == measured.end() ? std::nullopt : std::optional(found->second);
    record.left_out.push_back({kind.what, fmt::format("{} ({})", saved.why, kind.error), saved_text(saved, seconds)});
    record.figures[fmt::format("seconds saved, predicted: {}", kind.name)] = saved.predicted;
    if (seconds) record.figures[fmt::format("seconds saved, measured: {}", kind.name)] = *seconds;
  }
}

void record_render(const Rendering& r, const RenderSettings& settings, Provenance& record) {
  record.figures["rays"] = r.rays, record.figures["rays that hit"] = r.hits;
  record.figures["samples dropped"] = r.dropped, record.figures["pixels facing away"] = r.facing_away;
  for (const KernelProfile& k : r.kernels) record.figures["seconds: re-render, " + part_of(k.kernel)] += k.seconds;
  for (const auto& [part, rays] : r.answered) record.figures["rays answered " + part] = rays;
  record_samples(settings, record);
}

std::string guide_text(const Scene& scene, const RenderSettings& settings) {
  const std::optional<Tensor> lamps = known_lamps(scene, settings);
  return lamps ? fmt::format("directions towards {} lamps and bright patches", lamps->shape.w)
               : "none: no lamp is known and nothing is bright, vndf_caps drew";
}

/// For the plan: how many rays each part of a learned light was asked for.
std::string answered_text(const Rendering& r) {
  std::string text;
  for (const auto& [part, rays] : r.answered)
    text += fmt::format("light {}: asked for {:.0f} of {:.0f} rays ({:.1f} %)\n", part, rays, r.rays,
                        100 * rays / std::max(r.rays, 1.0));
  return text;
}

/// Free, or a run of the photograph with this hash.
bool fits_default(const fs::path& folder, const std::string& photo) {
  if (!fs::exists(folder) || (fs::is_directory(folder) && fs::is_empty(folder))) return true;
  try {
    const Provenance run = read_provenance(folder / kProvenanceName);
    return !run.inputs.empty() && run.inputs[0].hash == photo;
  } catch (const Error&) {
    return false;  // other things
  }
}

/// `--out`; or the first of runs/invert/STEM, PARENT-STEM, PARENT-STEM-2... that is not another photograph's.
std::unique_ptr<StagedFolder> open_folder(const InvertOptions& options) {
  const Replacing replacing{
      {options.photo, options.camera, options.gbuffer, options.weights, options.lit_by.weights, options.mask},
      options.force};
  if (!options.out.empty()) return std::make_unique<StagedFolder>(options.out, replacing);
  std::string stem = options.photo.stem().string();
  if (stem == "." || stem == "..") stem = "photo";  // of "..png": no folder's name
  const std::string hash = file_hash(options.photo);
  const std::string longer = fs::absolute(options.photo).parent_path().filename().string() + "-" + stem;
  for (int n = 0;; ++n) {
    const fs::path folder = fs::path("runs/invert") / (n == 0   ? stem
                                                       : n == 1 ? longer
                                                                : fmt::format("{}-{}", longer, n));
    if (!fits_default(folder, hash)) continue;
    auto staged = std::make_unique<StagedFolder>(folder, replacing);
    if (!fits_default(folder, hash)) continue;  // another process was faster
    if (n > 0) say(fmt::format("run: {}; {} is not of this photograph", folder.string(), stem));
    return staged;
  }
}

/// One photograph on its way through. Steps in order: read, predict, join, render, write.
class Inversion {
 public:
  explicit Inversion(const InvertOptions& options) : options_(options) {}

  fs::path run() {
    read();
    folder_ = open_folder(options_);
    if (rerenders()) check_light_weights(options_.render, options_.lit_by.weights);
    device_ = Device::open(options_.device);
    device_->use_tile(options_.tile), device_->use_gemm(options_.gemm);
    if (options_.render.precision == Precision::Double && !device_->has_double())
      throw usage_error("this device has no doubles", "--precision", "double", device_->info().name + ": single");
    begin_record();
    predict();
    join_maps();
    if (rerenders()) render();
    write();
    return options_.out.empty() ? folder_->target().lexically_proximate(fs::current_path()) : options_.out;
  }

 private:
  bool rerenders() const { return options_.only.empty(); }

  void read() {
    if (rerenders()) render_spec(options_.render);  // refused before the work
    photo_ = read_photo(options_.photo);
    const Image& image = photo_.image;
    if (options_.known) check_known(*options_.known, image);
    if (!options_.mask.empty())
      for (const float m : read_mask(options_.mask, image.width, image.height).data) judged_.push_back(m > 0);
    if (photo_.clamped) say(fmt::format("{}: {} negative values set to 0", options_.photo.string(), photo_.clamped));
    if (std::ranges::none_of(image.data, [](float v) { return v > 0; }))
      throw usage_error("the picture is black", options_.photo.string(), "no value above 0", "a photograph");
    if (fs::is_directory(options_.gbuffer)) gbuffer_lock_.emplace(options_.gbuffer, LockKind::Read);
    const bool own_camera = options_.camera.empty() && !options_.fov;  // of the maps
    if (!options_.gbuffer.empty()) given_ = read_gbuffer(options_.gbuffer, own_camera);
    if (given_.depth && (options_.known || options_.depth_scale))
      throw usage_error("the depth is given, in metres: none is predicted whose scale this could set",
                        options_.known ? "--known" : "--depth-scale", "beside --gbuffer " + options_.gbuffer.string(),
                        "one of them");
    require_size(given_.albedo, "albedo", options_, image), require_size(given_.normal, "normal", options_, image);
    require_size(given_.depth, "depth", options_, image), require_size(given_.material, "material", options_, image);
    scene_.photo = image;
    std::tie(scene_.camera, camera_note_) = choose_camera(options_, given_, photo_);
    say("camera: " + camera_note_);
    scene_.camera.check(options_.camera.empty() ? "--fov" : options_.camera.string());
  }

  void begin_record() {
    record_ = begin_provenance(options_.command, device_->fingerprint());
    record_.seeds["render"] = options_.render.seed;
    record_.inputs.push_back(record_file(options_.photo));
    for (const fs::path& file : {options_.mask, options_.camera})
      if (!file.empty()) record_.inputs.push_back(record_file(file));
    record_.facts["photo"] = photo_.note;
    record_.facts["camera"] = camera_note_;
    if (options_.render.precision == Precision::Double) record_.facts["precision"] = "double";
    if (device_->info().cpu) record_.facts["tile"] = device_->tile().name;
    if (given_.depth && fs::is_directory(options_.gbuffer)) inherit_facts(options_.gbuffer, record_);
    lap("reading");
  }

  /// Maps that are wanted and not given.
  void predict() {
    PredictRequest request;
    request.albedo = !given_.albedo && wanted(options_, "albedo");
    request.normal = !given_.normal && wanted(options_, "normal");
    request.depth = !given_.depth && wanted(options_, "depth");
    request.material = !given_.material && wanted(options_, "material");
    if (options_.preset == "paper") {
      tell_estimate(request);
      request.preset = options_.preset;
    }
    if (request.any()) {
      const fs::path weights = weights_or_shipped(options_.weights);
      prediction_ = predict_maps(*device_, weights, photo_.image, request, options_.render.precision);
      record_.inputs.push_back(record_file(weights));
      record_.facts["network"] = prediction_.note;
      for (const std::string& what : prediction_.left_out) record_.left_out.push_back({what, "not asked for", ""});
    }
    if (request.depth) {
      record_.facts[kDepthScaleFact] = scale_depth(options_, prediction_.depth, prediction_);
      say("depth: " + record_.facts[kDepthScaleFact]);
    }
    plan_ = prediction_.explanation;
    lap("network");
  }

  void tell_estimate(const PredictRequest& request) {
    const Image& image = photo_.image;
    const double rays = rerenders() ? static_cast<double>(image.pixels()) * render_spec(options_.render).spp : 0;
    AskedLight light{options_.render.light, {}, rays};
    if (rays > 0 && is_learned_light(light.name))
      light.net = read_light_sizes(light_or_shipped(options_.lit_by.weights));
    const InvertWork work = invert_work(*device_, options_.preset, image.width, image.height, request, light);
    say("estimate: " + describe(work, measure_ceilings(*device_).fma_gflops));
  }

  void join_maps() {
    if (wanted(options_, "albedo")) scene_.albedo = given_.albedo ? *given_.albedo : prediction_.albedo;
    if (wanted(options_, "normal")) scene_.normal = given_.normal ? *given_.normal : prediction_.normal;
    if (wanted(options_, "depth")) scene_.depth = given_.depth ? *given_.depth : prediction_.depth;
    if (!wanted(options_, "material")) return;
    scene_.material = given_.material ? *given_.material : prediction_.material;
    if (given_.material) return;
    const Image& image = photo_.image;
    const Image flags = photo_.encoding == Encoding::Gamma ? emission_flags(image) : lamp_flags(image);
    std::copy(flags.data.begin(), flags.data.end(), scene_.material.plane(2));
  }

  void render() {
    scene_.check(options_.photo.string());
    RenderSettings settings = options_.render;
    settings.spp = render_spec(settings).spp;  // a grid of directions has as many as it has
    settings.profile = true, settings.after_chunk = chunk_progress("re-render");
    take_light(settings, options_.lit_by, *device_, scene_, record_);
    lap("light");
    const RenderSettings lit = settings;
    const Rendering r = options_.goal ? render_to_goal(settings) : render_scene(*device_, scene_, settings);
    rerender_ = Rerender{r.radiance, r.standard_error, r.uncertainty};
    if (rounds_.empty()) rounds_ = {{lit.spp, lit.seed}};
    rendered_ = {lit, rounds_, r.shared_answers > 0};
    lap("re-render");
    record_render(r, settings, record_);
    if (settings.sampler == kGuidedSampler) record_.facts["guide"] = guide_text(scene_, settings);
    const double first_rays = static_cast<double>(scene_.photo.pixels()) * lit.spp;  // these decided
    if (const std::string why = why_none_are_shared(scene_, lit, first_rays); !why.empty())
      record_.facts["shared answers"] = "none: " + why;
    const SceneTraits traits = traits_of(scene_, settings);
    std::map<Saving, double> measured;
    if (options_.measure) measured = measure_savings(*device_, scene_, settings, r), lap("measuring what was left out");
    record_savings(traits, saved_in(traits, settings, r), measured, settings, record_);
    plan_ += r.explanation + answered_text(r);
    say(fmt::format("re-render: {:.1f} million rays, {:.1f} % hit a visible surface, {} samples dropped", r.rays * 1e-6,
                    100 * r.hits / std::max(r.rays, 1.0), r.dropped));
    if (const auto& first = r.first_dropped)
      say(fmt::format("re-render: first dropped sample: `clerestory replay RUN --at {},{} --sample {}`", first->x,
                      first->y, first->sample));
  }

  /// `settings` get the samples that it took.
  Rendering render_to_goal(RenderSettings& settings) {
    RenderedUntil reached = render_until(*device_, scene_, settings, *options_.goal, judged_);
    settings.spp = 0;
    for (const RenderRound& round : reached.rounds) {
      rounds_.push_back(
          {round.spp - settings.spp, round_seed(settings.seed, static_cast<std::uint32_t>(rounds_.size()))});
      settings.spp = round.spp;
    }
    record_rounds(*options_.goal, reached.rounds, judged_.empty() ? "the re-render" : "the re-render under the mask",
                  "re-render", record_);
    for (const RenderRound& round : reached.rounds)
      plan_ += fmt::format("re-render: {} samples a pixel, {:.2f} s, root relMSE {:.4f}\n", round.spp, round.seconds,
                           round.error);
    return std::move(reached.rendering);
  }

  void write() {
    StagedFolder& folder = *folder_;
    write_run(folder.path(), scene_, rerender_);
    record_.figures["MiB: device memory, most"] = static_cast<double>(device_->memory_peak()) / 0x1p20;
    record_.figures["seconds: building kernels"] = device_->build_seconds();
    lap("writing");
    record_.ended = utc_now();
    if (!plan_.empty()) write_file(folder / "plan.txt", plan_);
    if (rendered_) write_render_record(folder / kRenderRecord, *rendered_);
    record_.outputs = record_files_in(folder.path());
    write_provenance(folder / kProvenanceName, record_);
    write_run_report(folder.path());
    give_up_if_interrupted(options_.photo.string());
    folder.commit();
  }

  /// Between two steps: how long the last one took, and whether there is to be a next.
  void lap(const std::string& step) {
    record_.figures["seconds: " + step] = watch_.lap();
    give_up_if_interrupted(options_.photo.string());
  }

  const InvertOptions& options_;
  Stopwatch watch_;
  Photo photo_;
  std::vector<bool> judged_;  // the pixels over which an error is measured; empty: all
  std::optional<FolderLock> gbuffer_lock_;
  std::unique_ptr<StagedFolder> folder_;
  GBuffer given_;
  std::string camera_note_;
  Scene scene_;
  std::optional<Device> device_;
  Provenance record_;
  Prediction prediction_;
  std::optional<Rerender> rerender_;
  std::vector<SampleRound> rounds_;
  std::optional<RenderRecord> rendered_;
  std::string plan_;
};

}  // namespace

fs::path invert(const InvertOptions& options) {
  check_options(options);
  return Inversion(options).run();
}

}  // namespace clerestory
