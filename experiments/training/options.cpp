#include "experiments/training/options.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "host/io/data_files.hpp"
#include "host/ops/light/ask_field.hpp"
#include "host/ops/light/ask_mlp.hpp"
#include "host/ops/light/ray_mlp.hpp"

namespace clerestory {
namespace {

/// A path, of the working folder or, where it is not there, of the data that come with the program.
std::string found_text(const Config& config, const std::string& key) {
  const std::string& path = config.text(key);
  return path.empty() ? path : found_data(path).string();
}

void forbid(bool bad, const Config& config, const std::string& key, const std::string& what,
            const std::string& expected) {
  if (bad) throw usage_error(what, config.where(key), "", expected);
}

int whole_or(const Config& c, const std::string& key, int otherwise) {
  const int value = c.whole(key);
  return value > 0 ? value : otherwise;
}

bool imagenet_input(const Config& c) { return c.text("model.input") == "imagenet"; }

/// The preset's MGNet with what the config changes.
MgnetSize maps_net_of(const Config& c) {
  MgnetSize net = mgnet_size(c.text("model.preset"));
  const auto replace = [&](const char* key, std::span<int> list) {
    const auto& given = c.integers(key);
    forbid(!given.empty() && given.size() != list.size(), c, key, "another number of values",
           fmt::format("{}", list.size()));
    for (std::size_t i = 0; i < given.size(); ++i) list[i] = static_cast<int>(given[i]);
  };
  if (net.lite()) {
    auto& encoder = std::get<EfficientnetSize>(net.encoder);
    for (const char* key : {"model.growth", "model.first"})
      forbid(c.integer(key) > 0, c, key, "EfficientNet-Lite has no such size", "0 where model.preset = lite");
    forbid(imagenet_input(c), c, "model.input", "EfficientNet-Lite is shown its own",
           "plain where model.preset = lite");
    replace("model.channels", encoder.channels), replace("model.layers", encoder.layers);
  } else if (net.li2020()) {
    auto& encoder = std::get<Li2020MapsSize>(net.encoder);
    for (const char* key : {"model.growth", "model.first"})
      forbid(c.integer(key) > 0, c, key, "the net of Li et al. has no such size", "0 where model.preset = li2020");
    forbid(!c.integers("model.layers").empty(), c, "model.layers", "the net of Li et al. has no such sizes",
           "none where model.preset = li2020");
    forbid(imagenet_input(c), c, "model.input", "the net of Li et al. is shown the picture as it is",
           "plain where model.preset = li2020");
    replace("model.channels", encoder.encoder);
    forbid(std::ranges::any_of(encoder.encoder, [](int n) { return n % kLi2020Group != 0; }), c, "model.channels",
           "channels do not divide into groups", fmt::format("multiples of {}", kLi2020Group));
  } else {
    auto& encoder = std::get<DensenetSize>(net.encoder);
    forbid(!c.integers("model.channels").empty(), c, "model.channels", "DenseNet has no such sizes",
           "none unless model.preset = lite");
    encoder.imagenet_input = imagenet_input(c);
    forbid(encoder.imagenet_input && net.shared(), c, "model.input",
           "the shared form reads logarithms beside the picture", "plain where model.preset = shared");
    encoder.growth = whole_or(c, "model.growth", encoder.growth),
    encoder.first = whole_or(c, "model.first", encoder.first);
    replace("model.layers", encoder.layers);
  }
  replace("model.decoder", net.steps());
  forbid(!net.steps_wanted().empty(), c, "model.decoder", "channels do not divide into groups", net.steps_wanted());
  return net;
}

bool is_li2020_light(const Config& c) { return c.text("light.net") == "li2020"; }

/// The preset's light with what the config changes.
LightSizes light_net_of(const Config& c) {
  const std::string& preset = c.text("model.preset");
  forbid(preset != "paper" && preset != "compact", c, "model.preset", "the light's nets have no such preset",
         "paper or compact");
  LightSizes sizes = light_sizes(preset);
  if (is_li2020_light(c)) {
    forbid(imagenet_input(c), c, "model.input", "the light of Li et al. 2020 reads pictures as they are",
           "plain where light.net = li2020");
    sizes.li2020 = li2020_light_size(preset);
    return sizes;
  }
  InViewSize& in_view = sizes.in_view;
  sizes.delta = delta_depth_of(c.text("light.delta"));
  sizes.in_view.trunk.imagenet_input = sizes.out_of_view.trunk.imagenet_input = imagenet_input(c);
  if (!c.text("light.output").empty()) in_view.output = light_output_of(c.text("light.output"));
  in_view.width = whole_or(c, "light.width", in_view.width),
  in_view.layers = whole_or(c, "light.layers", in_view.layers);
  in_view.frequencies = whole_or(c, "light.frequencies", in_view.frequencies);
  if (c.real("light.direction_deviation") > 0) in_view.direction_deviation = c.real("light.direction_deviation");
  if (c.real("light.surface_deviation") > 0) in_view.surface_deviation = c.real("light.surface_deviation");
  // What trains but cannot be asked for light is of no use to anybody.
  forbid(in_view.width % 16 != 0, c, "light.width", fmt::format("{} numbers cannot be asked for light", in_view.width),
         "a multiple of 16");
  const int encoded = encoded_numbers(in_view);
  forbid(encoded > kMostMlpFeatures, c, "light.frequencies",
         fmt::format("{} encoded numbers cannot be asked for light", encoded),
         fmt::format("at most {}", kMostMlpFeatures / (encoded / in_view.frequencies)));
  forbid(c.integers("light.field").size() >= kMostFieldLayers, c, "light.field",
         fmt::format("{} hidden layers cannot be asked for light", c.integers("light.field").size()),
         fmt::format("at most {}", kMostFieldLayers - 1));
  forbid(in_view.again >= in_view.layers, c, "light.layers", "no layer left that is given the input again",
         fmt::format("more than {}", in_view.again));
  OutOfViewSize& far = sizes.out_of_view;
  if (!c.text("light.out_of_view").empty()) far.form = out_of_view_form(c.text("light.out_of_view"));
  far.sees_maps = far.sees_maps || c.flag("light.sees_maps");
  far.background = far.background || c.flag("light.background");
  forbid(far.background && far.form != OutOfViewForm::Field, c, "light.background", "shells have no colour behind them",
         "light.out_of_view = field");
  far.shells.count = whole_or(c, "light.shells", far.shells.count);
  far.march.segments = whole_or(c, "light.segments", far.march.segments);
  if (!c.integers("light.field").empty())
    far.hidden.assign(c.integers("light.field").begin(), c.integers("light.field").end());
  return sizes;
}

LightTrainingOptions light_step_of(const Config& c, const Size& size, const TrainSection& train) {
  LightTrainingOptions step;
  step.batch = train.batch, step.height = size.height, step.width = size.width;
  step.rows = c.whole("light.rows"), step.samples = c.whole("light.samples");
  step.shade_width = c.whole("light.shade_width"), step.shade_height = c.whole("light.shade_height");
  step.shade_samples = c.whole("light.shade_samples");
  for (const char* key : {"light.samples", "light.shade_samples"})
    forbid(c.whole(key) % 16 != 0, c, key, fmt::format("{} directions", c.whole(key)), "a multiple of 16");
  step.weights = {c.real("loss.mixed"), c.real("loss.out_of_view"), c.real("loss.rerender"), c.real("loss.irradiance"),
                  c.real("loss.unseen")};
  for (const char* key : {"loss.irradiance", "loss.unseen"})
    forbid(is_li2020_light(c) && c.real(key) > 0, c, key, "the light of Li et al. 2020 has no such term",
           "0 where light.net = li2020");
  if (is_li2020_light(c)) {  // it has no such parts, and renders its own cells
    step.weights.out_of_view = step.weights.irradiance = 0;
    step.shade_width = step.shade_height = 0;
  }
  forbid(step.weights.rerender > 0 && step.shade_width > 0 && shade_stride(step, size.width, size.height) == 0, c,
         "light.shade_width", "the grid that is rendered again does not divide the view",
         fmt::format("one step along both sides of {}x{}", size.width, size.height));
  step.radiance = radiance_loss_of(c.text("loss.radiance"));
  step.adam.beta1 = train.beta1, step.adam.beta2 = train.beta2, step.average = train.average;
  return step;
}

StreamOptions stream_of(const Config& c, const Size& size) {
  StreamOptions stream;
  stream.on = !c.text("stream.setting").empty();
  GenerateOptions& rooms = stream.rooms;
  rooms.rooms.setting = c.text("stream.setting") == "held_out" ? Setting::HeldOut : Setting::Training;
  rooms.rooms.seed = static_cast<std::uint64_t>(c.integer("stream.seed"));
  rooms.views.count = c.whole("stream.views"), rooms.views.spp = c.whole("stream.spp"),
  rooms.views.clamp = c.real("stream.clamp"), rooms.views.variance = false;
  rooms.light.wanted = c.text("model.kind") == "light", rooms.rooms.split = "train";
  rooms.views.handling = {c.real("stream.roll"), c.real("stream.close_ups"), c.real("stream.from_above")};
  const double across = 1 - rooms.views.handling.close_ups;
  forbid(rooms.views.handling.from_above > across, c, "stream.from_above", "a view is close up or from above, not both",
         fmt::format("at most {} beside stream.close_ups", across));
  rooms.light.spp = c.whole("stream.light_spp"), rooms.light.probes = c.whole("stream.probes");
  const int scale = rooms.light.wanted ? 1 : c.whole("stream.scale");  // light lies at the pixels of its view
  rooms.views.width = scale * size.width, rooms.views.height = scale * size.height;
  stream.times = c.whole("stream.times"), stream.window = c.whole("stream.window");
  stream.makers = c.whole("stream.makers"), stream.unread = c.whole("train.batch") * (kBatchesAhead + 2);
  stream.fixed = c.real("stream.fixed"), stream.crop_low = c.real("stream.crop");
  stream.device = c.text("run.device");
  forbid(stream.on && c.real("train.epochs") > 0, c, "train.epochs", "a stream of rooms has no end to pass over",
         "train.steps or train.minutes");
  return stream;
}

std::vector<JudgingList> lists_of(const Config& c) {
  std::vector<JudgingList> lists;
  for (const std::string& text : c.texts("data.lists")) {
    const std::size_t sign = text.find('=');
    const bool named = sign != std::string::npos && sign > 0 && sign + 1 < text.size();
    if (!named)
      throw usage_error("is no list of rooms", c.where("data.lists"), text,
                        "NAME=FOLDER, such as held_out=data/judge/held_out");
    lists.push_back({text.substr(0, sign), text.substr(sign + 1), false});
    const auto same = [&](const JudgingList& other) { return other.name == lists.back().name; };
    if (std::ranges::count_if(lists, same) > 1)
      throw usage_error("two lists have one name", c.where("data.lists"), lists.back().name);
  }
  for (const std::string& name : c.texts("data.photographed")) {
    const auto found = std::ranges::find(lists, name, &JudgingList::name);
    if (found == lists.end()) throw usage_error("is no list of data.lists", c.where("data.photographed"), name);
    lists.push_back({name + ", photographed as JPEG", found->folder, true});
  }
  return lists;
}

RunSection run_of(const Config& c) {
  return {c.text("run.root"),   c.text("run.experiment"), c.text("run.variant"),
          c.text("run.device"), c.text("run.tile"),       static_cast<std::uint64_t>(c.integer("run.seed"))};
}

ModelSection model_of(const Config& c) {
  ModelSection o;
  o.kind = c.text("model.kind"), o.preset = c.text("model.preset");
  o.net = maps_net_of(c);
  if (o.kind == "light") o.light = light_net_of(c);
  o.size = {c.whole("model.width"), c.whole("model.height")};
  o.encoder = c.text("model.encoder"), o.init = found_text(c, "model.init"), o.gemm = c.text("model.gemm");
  return o;
}

Augmentation augmentation_of(const Config& c) {
  const auto& exposure = c.reals("data.exposure");
  forbid(exposure.size() != 2 || exposure[0] > exposure[1], c, "data.exposure", "not a range",
         "two numbers, the lower first");
  return {c.flag("data.flip"), exposure[0], exposure[1], c.real("data.photographs"), c.real("data.painted")};
}

/// What only a maps' training knows.
void forbid_for_light(const Config& c) {
  forbid(!c.texts("data.frames").empty(), c, "data.frames", "photographs with measured depth say nothing of light",
         "none where model.kind = light");
  for (const auto& [key, given] : {std::pair{"data.photographs", c.real("data.photographs") > 0},
                                   std::pair{"data.painted", c.real("data.painted") > 0},
                                   std::pair{"data.photographed", !c.texts("data.photographed").empty()}})
    forbid(given, c, key, "the light's views are seen as they were traced", "left out where model.kind = light");
  for (const char* key : {"finetune.iiw", "finetune.nyu"})
    forbid(!c.text(key).empty(), c, key, "photographs have no light that is known", "none where model.kind = light");
}

FinetuneOptions finetune_of(const Config& c) {
  const FinetuneOptions o{c.text("finetune.iiw"), c.text("finetune.nyu"), c.text("finetune.nyu_list"),
                          c.real("finetune.share")};
  forbid(!o.nyu_list.empty() && o.nyu.empty(), c, "finetune.nyu_list", "a list of no photographs",
         "finetune.nyu beside it");
  forbid(o.on() && o.share == 0, c, "finetune.share", "no view would be a photograph",
         "above 0 beside finetune.iiw or "
         "finetune.nyu");
  return o;
}

DataSection data_of(const Config& c, const ModelSection& model) {
  if (model.kind == "light") forbid_for_light(c);
  DataSection o;
  o.train_roots = c.texts("data.train"), o.validation_roots = c.texts("data.validation");
  if (o.validation_roots.empty()) o.validation_roots = o.train_roots;
  o.train_split = c.text("data.train_split"), o.validation_split = c.text("data.validation_split");
  o.validation_views = c.whole("data.validation_views"), o.mean_views = c.whole("data.mean_views");
  o.lists = lists_of(c), o.list_views = c.whole("data.list_views");
  o.frames.assign(c.texts("data.frames").begin(), c.texts("data.frames").end());
  o.cache_bytes = static_cast<std::uint64_t>(c.integer("data.cache_mib")) << 20;
  o.augmentation = augmentation_of(c);
  o.stream = stream_of(c, model.size);
  o.finetune = finetune_of(c);
  return o;
}

LearningRate rate_of(const Config& c) {
  const std::string& schedule = c.text("train.schedule");
  LearningRate rate;
  rate.kind = schedule == "step"     ? LearningRate::Kind::Step
              : schedule == "cosine" ? LearningRate::Kind::Cosine
                                     : LearningRate::Kind::Constant;
  rate.initial = c.real("train.rate"), rate.least = c.real("train.rate_least");
  rate.factor = c.real("train.rate_factor"), rate.every = c.real("train.rate_every");
  rate.warmup = c.integer("train.warmup");
  return rate;
}

TrainSection train_of(const Config& c) {
  TrainSection o;
  o.batch = c.whole("train.batch");
  o.steps = c.integer("train.steps"), o.epochs = c.real("train.epochs"), o.minutes = c.real("train.minutes");
  forbid(o.steps == 0 && o.epochs == 0 && o.minutes == 0, c, "train.steps", "the run has no end",
         "train.steps, train.epochs or train.minutes above 0");
  o.memory = static_cast<std::size_t>(c.integer("train.memory_mib")) << 20;
  o.memory_key = c.where("train.memory_mib");
  o.rate = rate_of(c), o.encoder_rate = c.real("train.encoder_rate");
  o.beta1 = c.real("train.beta1"), o.beta2 = c.real("train.beta2"), o.average = c.real("train.average");
  o.runaway = c.real("train.runaway");
  return o;
}

/// What the perceptual term looks through; nothing where there is no such term.
std::optional<PerceptualFeatures> features_of(const Config& c) {
  using From = PerceptualFeatures::From;
  const std::string &from = c.text("loss.perceptual_features"), &file = c.text("loss.perceptual_weights");
  const auto refuse = [&](bool bad, const std::string& key, const char* what, const std::string& expected) {
    if (bad) throw usage_error(what, c.where(key), c.text(key), expected);
  };
  if (from.empty() && file.empty()) return std::nullopt;
  refuse(c.text("loss.terms") == "li2020", from.empty() ? "loss.perceptual_weights" : "loss.perceptual_features",
         "the terms of Li et al. have no perceptual part", "none where loss.terms = li2020");
  refuse(from == "random" && !file.empty(), "loss.perceptual_weights", "random features are read from no file",
         "none where loss.perceptual_features = random");
  refuse(from != "random" && file.empty(), "loss.perceptual_features", "these features are read from a file",
         "loss.perceptual_weights=FILE beside it");
  return PerceptualFeatures{from == "random" ? From::Random : from == "rooms" ? From::Rooms : From::Imported};
}

LossSection loss_of(const Config& c) {
  LossSection o;
  o.perceptual_weights = found_text(c, "loss.perceptual_weights");
  LossWeights& w = o.weights;
  w.terms = map_losses_of(c.text("loss.terms"));
  const std::optional<PerceptualFeatures> features = features_of(c);
  if (features) w.features = *features;
  w.albedo = c.real("loss.albedo"), w.normal = c.real("loss.normal"), w.material = c.real("loss.material");
  w.depth = c.real("loss.depth"), w.log_depth = c.real("loss.log_depth"), w.scale = c.real("loss.scale");
  w.depth_detail = c.real("loss.depth_detail"), w.albedo_detail = c.real("loss.albedo_detail");
  w.judgements = c.text("finetune.iiw").empty() ? 0 : c.real("loss.judgements");
  w.metallic = c.real("loss.metallic"), w.perceptual = features ? c.real("loss.perceptual") : 0;
  return o;
}

LightSection light_of(const Config& c, const TrainingOptions& o) {
  const Augmentation& a = o.data.augmentation;
  LightSection light;
  if (o.model.kind == "light") light.step = light_step_of(c, o.model.size, o.train);
  light.sampling = {c.real("light.clipped"), c.real("light.probe_rows"), a.flip, a.exposure_low,
                    a.exposure_high,         c.flag("light.ldr")};
  if (is_li2020_light(c)) light.sampling.probe_rows = 0;
  light.maps = c.text("light.maps"), light.maps_weights = found_text(c, "light.maps_weights");
  return light;
}

}  // namespace

double LegLimits::fraction(std::int64_t step, double minutes_so_far) const {
  double part = 0;
  if (steps > 0) part = std::max(part, static_cast<double>(step) / static_cast<double>(steps));
  if (minutes > 0) part = std::max(part, minutes_so_far / minutes);
  return std::min(part, 1.0);
}

double LearningRate::at(std::int64_t step, double fraction) const {
  double rate = initial;
  if (kind == Kind::Step) rate *= std::pow(factor, std::floor(std::min(fraction, 1 - 1e-9) / every + 1e-9));
  if (kind == Kind::Cosine) rate *= least + (1 - least) * 0.5 * (1 + std::cos(std::numbers::pi * fraction));
  if (step < warmup) rate *= static_cast<double>(step + 1) / static_cast<double>(warmup);
  return rate;
}

TrainingOptions training_options(const Config& c) {
  TrainingOptions o;
  o.run = run_of(c), o.model = model_of(c), o.data = data_of(c, o.model), o.train = train_of(c), o.loss = loss_of(c);
  o.light = light_of(c, o);
  o.log = {c.integer("log.every"), c.integer("log.validate_every"), c.integer("log.checkpoint_every"),
           c.real("log.checkpoint_minutes")};
  return o;
}

}  // namespace clerestory
