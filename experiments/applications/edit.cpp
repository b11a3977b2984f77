#include "experiments/applications/edit.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/chunk_progress.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/mask.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/applications/run_results.hpp"
#include "experiments/applications/samples_record.hpp"
#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/shade/repaint.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/report/own_files.hpp"
#include "host/report/preview.hpp"
#include "host/report/progress.hpp"
#include "host/report/staged_folder.hpp"
#include "host/stopwatch.hpp"
#include "nets/known_lamps.hpp"
#include "nets/scene_layer.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// The specular lobe of a scene's materials alone: metal whose base colour is their reflectance at normal incidence.
std::pair<Image, Image> specular_alone(const Scene& scene) {
  Image albedo = scene.albedo, material = scene.material;
  const std::size_t n = albedo.pixels();
  for (std::size_t i = 0; i < n; ++i) {
    const float metallic = material.data[n + i];
    for (std::size_t c = 0; c < 3; ++c) albedo.data[c * n + i] = 0.04f + metallic * (albedo.data[c * n + i] - 0.04f);
    material.data[n + i] = 1;
  }
  return {std::move(albedo), std::move(material)};
}

Image image_of(const std::vector<bool>& flags, const Scene& scene) {
  Image image(scene.width(), scene.height(), 1);
  std::ranges::copy(flags, image.data.begin());
  return image;
}

/// Materials before and after as values of a graph.
Repainted materials_of(Graph& graph, const Scene& before, const EditedScene& with) {
  const auto constant = [&](const Image& image) { return graph.constant(tensor_of(image)); };
  return {constant(before.albedo), constant(before.material), constant(with.scene.albedo),
          constant(with.scene.material), constant(image_of(with.emitted, before))};
}

/// Whether some diffuse part is the layer's to say.
bool needs_layer(Device& device, const Scene& before, const EditedScene& with) {
  Graph graph;
  const Image share = pictures_by(device, graph, {repaint_layer_share(materials_of(graph, before, with))})[0];
  for (std::size_t i = 0; i < with.edited.size(); ++i)
    if (with.edited[i] && share.data[i] > 0) return true;
  return false;
}

/// Adds a change to the composite; light is not negative. Returns the change that is left, and which share of pixels.
Image add_change(Device& device, Image& composite, const Image& change, double& changed) {
  Graph graph;
  const Value before = graph.constant(tensor_of(composite));
  const Value after = relu(add(before, graph.constant(tensor_of(change))));
  std::vector<Image> made = pictures_by(device, graph, {after, subtract(after, before)});
  composite = std::move(made[0]);
  const std::size_t n = composite.pixels();
  std::vector<bool> touched(n, false);
  for (std::size_t i = 0; i < made[1].data.size(); ++i)
    if (made[1].data[i] != 0) touched[i % n] = true;
  changed = static_cast<double>(std::ranges::count(touched, true)) / static_cast<double>(n);
  return std::move(made[1]);
}

/// The mean of a picture over all samples so far.
class MeanPicture {
 public:
  void add(const Image& picture, double samples) {
    samples_ += samples;
    if (mean_.data.empty()) mean_ = picture;
    for (std::size_t i = 0; i < mean_.data.size(); ++i)
      mean_.data[i] += static_cast<float>(samples / samples_ * (static_cast<double>(picture.data[i]) - mean_.data[i]));
  }
  const Image& mean() const { return mean_; }

 private:
  Image mean_;
  double samples_ = 0;
};

/// An edit whose samples are added to those before: what is not linear, the photograph's share and light that is not
/// negative, is done to means.
class Editing {
 public:
  /// Rays of bounces behind the first end on a change, whoever answered for the light before; lamps are out of view and
  /// do not change, and what is bright in the photograph is not what a change is bright in.
  Editing(Device& device, const Scene& before, EditedScene with, const RenderSettings& settings, int bounces)
      : device_(device), before_(before), with_(std::move(with)), first_(settings), carried_(settings) {
    carried_.light = "image", carried_.lamps.clear();
    if (carried_.sampler == kGuidedSampler) carried_.sampler = RenderSettings{}.sampler;
    thrown_.resize(static_cast<std::size_t>(bounces - 1));
    bounces_.resize(static_cast<std::size_t>(bounces));
    speaks_ = needs_layer(device, before, with_);
  }

  void take(int samples, std::uint32_t round) {
    first_.spp = carried_.spp = samples;
    const std::uint32_t seed = round_seed(first_.seed, round);
    SceneLayer first(device_, before_, first_);
    composite_ = before_.photo;
    Image left = change_by(0, first_change(first, seed, samples));
    std::optional<SceneLayer> other;
    SceneLayer* layer = &first;
    const std::vector<bool> everywhere(before_.photo.pixels(), true);
    for (followed_ = 1; followed_ < bounces_.size() && bounces_[followed_ - 1].changed > 0; ++followed_) {
      if (followed_ == 1 && !carries_on()) layer = &other.emplace(device_, before_, carried_);
      const Image& thrown =
          layer->radiance(with_.scene.albedo, with_.scene.material, left, {0, 0, 0}, everywhere, seed);
      count(*layer, bounces_[followed_]);
      thrown_[followed_ - 1].add(thrown, samples);
      left = change_by(followed_, thrown_[followed_ - 1].mean());
    }
    seconds_ += first.seconds() + (other ? other->seconds() : 0);
  }

  /// The composite, judged where it shows a new material.
  RoundPicture so_far() const { return {composite_, shaded_, shown_exposure(before_.photo)}; }
  Edit finished(std::vector<RenderRound> rounds) && {
    bounces_.resize(followed_);
    const double shown = static_cast<double>(std::ranges::count(shaded_, true)) / static_cast<double>(shaded_.size());
    return {std::move(with_), std::move(composite_), std::move(bounces_), shown, seconds_, std::move(rounds)};
  }

 private:
  /// Whether the layer of the first bounce does for the others.
  bool carries_on() const {
    return first_.light == carried_.light && first_.lamps.empty() && first_.sampler == carried_.sampler;
  }
  static void count(const SceneLayer& layer, EditBounce& bounce) {
    bounce.rays += layer.counts().directions, bounce.dropped += layer.counts().dropped;
  }
  Image change_by(std::size_t bounce, const Image& change) {
    return add_change(device_, composite_, change, bounces_[bounce].changed);
  }

  /// D_1: what the edited pixels show less the photograph; 0 elsewhere.
  Image first_change(SceneLayer& layer, std::uint32_t seed, int samples) {
    const std::array<double, 3> ambient = ambient_of(before_);
    const auto render = [&](const Image& albedo, const Image& material, MeanPicture& mean) {
      mean.add(layer.radiance(albedo, material, before_.photo, ambient, with_.edited, seed), samples);
      count(layer, bounces_[0]);
    };
    const auto [albedo, material] = specular_alone(with_.scene);
    const auto [old_albedo, old_material] = specular_alone(before_);
    render(old_albedo, old_material, old_specular_), render(albedo, material, specular_);
    shaded_ = layer.shaded();
    if (speaks_) render(with_.scene.albedo, with_.scene.material, whole_);

    Graph graph;
    const auto constant = [&](const Image& image) { return graph.constant(tensor_of(image)); };
    const MeanPicture& whole = speaks_ ? whole_ : specular_;
    return pictures_by(
        device_, graph,
        {repaint(constant(before_.photo), materials_of(graph, before_, with_), constant(image_of(shaded_, before_)),
                 {constant(old_specular_.mean()), constant(specular_.mean()), constant(whole.mean())})})[0];
  }

  Device& device_;
  const Scene& before_;
  EditedScene with_;
  RenderSettings first_, carried_;  // of bounce 1, of those behind it
  bool speaks_ = false;             // some diffuse part is the layer's to say
  MeanPicture old_specular_, specular_, whole_;
  std::vector<MeanPicture> thrown_;  // by bounces behind the first
  Image composite_;
  std::vector<bool> shaded_;
  std::vector<EditBounce> bounces_;
  std::size_t followed_ = 0;
  double seconds_ = 0;
};

void check_change(const MaterialEdit& change) {
  const auto check = [](double value, const char* option) {
    if (!(value >= 0 && value <= 1)) throw usage_error("out of range", option, fmt::format("{}", value), "0 to 1");
  };
  if (!change.albedo && !change.roughness && !change.metallic)
    throw usage_error("no change is asked for", "edit", "no value", "--albedo, --roughness or --metallic");
  if (change.albedo)
    for (const double a : *change.albedo) check(a, "--albedo");
  if (change.roughness) check(*change.roughness, "--roughness");
  if (change.metallic) check(*change.metallic, "--metallic");
}

void check_bounces(int bounces) {
  if (bounces < 1 || bounces > kMostEditBounces)
    throw usage_error("out of range", "--bounces", fmt::format("{}", bounces),
                      fmt::format("1 to {}", kMostEditBounces));
}

std::string values_text(const MaterialEdit& change) {
  std::string text;
  if (change.albedo) {
    const auto& a = *change.albedo;
    text += fmt::format("albedo {:g}, {:g}, {:g}; ", a[0], a[1], a[2]);
  }
  if (change.roughness) text += fmt::format("roughness {:g}; ", *change.roughness);
  if (change.metallic) text += fmt::format("metallic {:g}; ", *change.metallic);
  return text.substr(0, text.size() - 2);
}

std::string bounces_text(const std::vector<EditBounce>& bounces) {
  std::string text = "1: what the edited surface reflects";
  for (std::size_t k = 1; k < bounces.size(); ++k)
    text +=
        fmt::format("; {}: what {} on all surfaces", k + 1, k == 1 ? "it throws" : fmt::format("bounce {} throws", k));
  return text;
}

}  // namespace

double EditedScene::share() const {
  return static_cast<double>(std::count(edited.begin(), edited.end(), true)) / static_cast<double>(edited.size());
}

EditedScene apply_edit(const Scene& scene, const Image& mask, const MaterialEdit& change) {
  check_change(change);
  if (mask.width != scene.width() || mask.height != scene.height() || mask.channels != 1)
    throw usage_error("the mask has another size than the picture", "--mask",
                      fmt::format("{}x{}", mask.width, mask.height),
                      fmt::format("{}x{}", scene.width(), scene.height()));
  if (std::none_of(mask.data.begin(), mask.data.end(), [](float m) { return m > 0; }))
    throw usage_error("the mask is empty", "--mask", "no pixel above one half", "at least one");
  const std::size_t n = scene.photo.pixels();
  EditedScene with{scene, std::vector<bool>(n, false), std::vector<bool>(n, false)};
  bool any = false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(mask.data[i] > 0 && scene.depth.data[i] > 0)) continue;
    any = true;
    bool differs = false;
    const auto set = [&differs](float& to, double value) {
      differs = differs || to != static_cast<float>(value);
      to = static_cast<float>(value);
    };
    for (std::size_t c = 0; change.albedo && c < 3; ++c) set(with.scene.albedo.data[c * n + i], (*change.albedo)[c]);
    if (change.roughness) set(with.scene.material.data[i], *change.roughness);
    if (change.metallic) set(with.scene.material.data[n + i], *change.metallic);
    float& flag = with.scene.material.data[2 * n + i];
    with.emitted[i] = flag > 0;
    set(flag, 0);
    with.edited[i] = differs;
  }
  if (!any)
    throw usage_error("there is no depth at any pixel of the mask", "--mask", "no surface", "at least one surface");
  return with;
}

Edit edit_scene(Device& device, const Scene& scene, const Image& mask, const MaterialEdit& change,
                const RenderSettings& settings, int bounces, const std::optional<RenderGoal>& goal) {
  check_bounces(bounces);
  if (goal) check_goal(settings, *goal);
  Editing editing(device, scene, apply_edit(scene, mask, change), settings, bounces);
  if (!goal) {
    editing.take(settings.spp, 0);
    return std::move(editing).finished({});
  }
  std::vector<RenderRound> rounds = take_rounds(*goal, settings.spp, [&](int samples, std::uint32_t round) {
    editing.take(samples, round);
    return editing.so_far();
  });
  return std::move(editing).finished(std::move(rounds));
}

std::string edit(const EditOptions& options) {
  const Stopwatch watch;
  check_change(options.change), check_bounces(options.bounces);
  is_learned_light(options.render.light), render_spec(options.render);
  if (options.goal) check_goal(options.render, *options.goal);
  const fs::path out = options.out.empty() ? options.run / "edit" : options.out;
  const FolderLock lock = lock_run(options.run, LockKind::Read);
  StagedFolder folder(out, {.inputs = {options.run, options.mask, options.lit_by.weights}, .force = options.force});
  const Scene scene = read_run(options.run);
  const Image mask = read_mask(options.mask, scene.width(), scene.height());
  Device device = Device::open(options.device);
  device.use_gemm(options.gemm);
  Provenance provenance = begin_provenance(options.command, device.fingerprint());
  inherit_facts(options.run, provenance);
  RenderSettings render = options.render;
  render.after_chunk = chunk_progress("edit");
  take_light(render, options.lit_by, device, scene, provenance);
  const Edit done = edit_scene(device, scene, mask, options.change, render, options.bounces, options.goal);

  Scene after = done.with.scene;
  after.photo = done.composite;
  write_run(folder.path(), after, std::nullopt);
  write_exr(folder / "composite.exr", done.composite, ExrType::Float);  // the photograph of this run, bit for bit
  write_png(folder / "composite.png", show_radiance(done.composite, shown_exposure(scene.photo)), Encoding::Linear);
  write_png(folder / "mask.png", mask, Encoding::Linear);

  const double pixels = static_cast<double>(scene.photo.pixels());
  std::vector<bool> differs(scene.photo.pixels(), false);
  for (std::size_t i = 0; i < scene.photo.data.size(); ++i)
    if (done.composite.data[i] != scene.photo.data[i]) differs[i % differs.size()] = true;
  const double changed = static_cast<double>(std::count(differs.begin(), differs.end(), true)) / pixels;
  const double flagged = static_cast<double>(std::count(done.with.emitted.begin(), done.with.emitted.end(), true));
  double dropped = 0, rays = 0;
  for (const EditBounce& b : done.bounces) dropped += b.dropped, rays += b.rays;
  provenance.seeds["render"] = options.render.seed;
  provenance.inputs.insert(provenance.inputs.begin(),
                           {record_file(options.run / "photo.exr"), record_file(options.mask)});
  provenance.facts[kEditFact] = values_text(options.change);
  provenance.facts["bounces that follow the edit"] = bounces_text(done.bounces);
  for (std::size_t k = 0; k < done.bounces.size(); ++k)
    provenance.facts[fmt::format("bounce {}", k + 1)] =
        fmt::format("{:.2f} million rays, {:.1f} % of the picture changed", done.bounces[k].rays * 1e-6,
                    100 * done.bounces[k].changed);
  if (options.goal) {
    record_rounds(*options.goal, done.rounds, "the edit", "edit", provenance);
    render.spp = done.rounds.back().spp;
  }
  record_samples(render, provenance);
  provenance.facts["pixels"] =
      fmt::format("{:.1f} % under the mask, {:.1f} % shown with the new material, {:.2f} % emitted and no longer do",
                  100 * sum(mask.data) / pixels, 100 * done.shown, 100 * flagged / pixels);
  provenance.figures["samples dropped"] = dropped;
  provenance.figures["share of pixels that change"] = changed;
  provenance.figures["seconds: render"] = done.seconds;
  provenance.left_out.push_back({"in bounce 1, pixels that are not edited", "at equal seeds their change is exactly 0",
                                 fmt::format("{:.1f} % of the picture's rays", 100 * (1 - done.with.share()))});
  provenance.left_out.push_back({"the render without the edit", "the layer is linear in its light", "one render"});
  const double seconds = watch.seconds();
  provenance.figures["seconds"] = seconds;
  provenance.ended = utc_now();
  provenance.outputs = record_files_in(folder.path());
  write_provenance(folder / kProvenanceName, provenance);
  write_run_report(folder.path());
  give_up_if_interrupted("edit");
  folder.commit();

  say(fmt::format("edit: {} in {:.1f} % of the picture, {:.1f} s: {}", values_text(options.change), 100 * done.shown,
                  seconds, (out / "composite.png").string()));
  say("edit: bounces that follow it: " + bounces_text(done.bounces));
  if (dropped > 0)
    say(fmt::format("edit: {:.0f} samples of {:.2f} million were not finite and count as nothing", dropped,
                    rays * 1e-6));
  nlohmann::ordered_json json{{"composite", (out / "composite.exr").string()},
                              {"edited", done.shown},
                              {"changed", changed},
                              {"dropped", dropped},
                              {"seconds", seconds}};
  for (const EditBounce& b : done.bounces) json["bounces"].push_back({{"rays", b.rays}, {"changed", b.changed}});
  if (options.goal) json["samples"] = render.spp, json["error"] = done.rounds.back().error;
  return json_text(json, 2);
}

}  // namespace clerestory
