#include "experiments/training/schema.hpp"

#include "host/cl/tile.hpp"
#include "host/ops/light/ask_field.hpp"
#include "host/ops/light/ask_mlp.hpp"

namespace clerestory {
namespace {

void add_run_keys(Schema& s) {
  s.section("run", "Where the run goes: `<root>/<experiment>/<variant>-<hash>-s<seed>/`.");
  s.text("run.root", "runs", "folder of all runs").aside();
  s.text("run.experiment", "train", "first part of the run's name").aside();
  s.text("run.variant", "mgnet", "second part of the run's name").aside();
  s.text("run.device", "", "OpenCL device; empty: CLERESTORY_DEVICE or the first that passes the probe").aside();
  s.text("run.tile", "auto", "register tile of our kernels on a CPU; auto: the fastest, measured once", tile_choices())
      .aside();
  s.integer("run.seed", 1, "of the first weights, the order of views and the augmentation", {0, 1e15}).aside();
}

void add_model_keys(Schema& s) {
  s.section("model", "The network.");
  s.text("model.kind", "maps", "what is trained: MGNet's maps, or the light", {"maps", "light"});
  s.text("model.preset", "compact",
         "size of the net; shared: one decoder for all maps; lite: and EfficientNet-Lite as its encoder; li2020: the "
         "net of Li et al. 2020, as large as compact or as in their paper (maps)",
         {"paper", "compact", "shared", "lite", "li2020", "li2020_paper"});
  s.integer("model.growth", 0, "channels that each dense layer adds; 0: the preset's", {0, 256});
  s.integer("model.first", 0, "channels of the first convolution; 0: the preset's", {0, 1024});
  s.integers("model.layers", {}, "layers of the four dense blocks, or of lite's seven stages; empty: the preset's",
             {1, 256});
  s.integers("model.channels", {},
             "channels of lite's seven stages, or of li2020's six, multiples of 16; empty: the preset's", {1, 4096});
  s.integers(
      "model.decoder", {},
      "channels of the decoders' five steps, multiples of 32, 16, 16, 8, 4, or of the shared one's six, of 8, or "
      "of li2020's six, of 16; empty: the preset's",
      {1, 4096});
  s.integer("model.width", 160, "width of the views it is trained on, pixels", {16, 4096});
  s.integer("model.height", 120, "height; views of other proportions are cut at the centre", {16, 4096});
  s.text("model.init", "",
         "weights or checkpoint to start from, or an encoder that `weights import` wrote; empty: random weights, of "
         "lite see "
         "model.encoder");
  s.text(
      "model.encoder", "imagenet",
      "lite: what its encoder starts from where model.init is empty; imagenet: the weights that come with the program",
      {"imagenet", "random"});
  s.text(
      "model.input", "plain",
      "what DenseNet and the light's ResNets are shown: the picture as it is, or display-coded, less ImageNet's mean "
      "and over its deviation, which imported weights expect (`clerestory weights import`)",
      {"plain", "imagenet"});
  s.text("model.gemm", "auto", "who multiplies in the nets", gemm_choices());
}

void add_data_keys(Schema& s) {
  s.section("data", "Views in InteriorVerse's layout (`clerestory generate` writes it).");
  s.texts("data.train", {"data/generated"}, "folders with training rooms");
  s.text("data.train_split", "train", "list of rooms in those folders");
  s.texts("data.validation", {}, "folders with validation rooms; empty: the training folders");
  s.text("data.validation_split", "val", "list of rooms in those folders");
  s.integer("data.validation_views", 64, "views judged at each validation, spread over the list; 0: all", {0, 1e9})
      .aside();
  s.texts(
       "data.lists", {},
       "fixed lists of rooms judged beside the validation, as NAME=FOLDER (`generate --from-rooms` makes the folder)")
      .aside();
  s.integer("data.list_views", 64, "views judged of each such list, spread over it; 0: all", {0, 1e9}).aside();
  s.texts("data.frames", {}, "folders of photographs with measured depth, judged beside them (maps)").aside();
  s.integer("data.mean_views", 1024, "training views behind the mean maps, spread over the list; 0: all", {0, 1e9})
      .aside();
  s.integer("data.cache_mib", 8192, "memory for decoded views; views beyond are decoded again every epoch", {0, 1e7})
      .aside();
  s.flag("data.flip", true, "mirror half of the views (the normal's x changes sign)");
  s.reals("data.exposure", {0.85, 0.95},
          "range of the 95th percentile of luminance, drawn anew each time; 0.9 is what inference uses", {0.01, 10});

  s.real("data.photographs", 0,
         "share of the views seen through a camera: clipping, white balance, tone curve, noise, blur, vignetting, JPEG "
         "(maps)",
         {0, 1});
  s.real("data.painted", 0, "share of the views that have other colours and patterns each time they are seen (maps)",
         {0, 1})
      .later();
  s.texts("data.photographed", {}, "names of data.lists that are judged a second time, seen through such a camera")
      .aside();
}

void add_stream_keys(Schema& s) {
  s.section("stream", "Rooms made while training goes on, seen a few times and dropped.");
  s.text("stream.setting", "", "content of these rooms; empty: views come from data.train alone",
         {"", "training", "held_out"});
  s.integer("stream.seed", 1, "rooms of different seeds share nothing", {0, 1e15});
  s.integer("stream.views", 2, "views of a room", {1, 100});
  s.real("stream.roll", 0, "degrees: views are turned about their axis by at most so much, mostly by less", {0, 45});
  s.real("stream.close_ups", 0, "share of the views that look at a piece of furniture from 0.6 to 1.6 m", {0, 1});
  s.real("stream.from_above", 0, "share of the views that look down from where a person stands", {0, 1});
  s.integer("stream.spp", 8, "samples a pixel", {1, 4096});
  s.integer("stream.scale", 2, "maps: views are traced so many times as large as the net's, then filtered down",
            {1, 8});
  s.real("stream.clamp", 1, "most that one indirect contribution adds, in units of the picture's white; 0: no bound",
         {0, 1e6});
  s.integer("stream.times", 8, "times that a view is seen, in the mean", {1, 1e6});
  s.integer("stream.window", 48, "rooms that are drawn from at a time", {1, 4096});
  s.integer(
      "stream.makers", 0,
      "threads that make rooms, each with a queue of its own; 0: one on a CPU, a third of the host's cores beside "
      "another device",
      {0, 256});
  s.real("stream.fixed", 0, "share of the views that come from data.train; 0: that is not read", {0, 1});
  s.real("stream.crop", 1, "maps: a view is cut to at least this share of its width, drawn anew each time", {0.1, 1});
  s.integer("stream.light_spp", 16, "light: samples of a texel of an environment map", {1, 4096});
  s.integer("stream.probes", 2, "light: probes in a view's free air", {0, 100});
}

void add_finetune_keys(Schema& s) {
  s.section("finetune", "Photographs with people's judgements or measured depth among the views (maps).");
  s.text("finetune.iiw", "", "folder of IIW, whose training split says which of two points has the darker albedo")
      .later();
  s.text("finetune.nyu", "", "folder of NYUv2: nyu_depth_v2_labeled.mat, and normals and masks as Li et al. keep them")
      .later();
  s.text("finetune.nyu_list", "", "file with the numbers of its pictures, one a line; empty: all").later();
  s.real("finetune.share", 0.5, "share of the views that are photographs, half of each set where there are both",
         {0, 1})
      .later();
}

void add_train_keys(Schema& s) {
  s.section("train", "Optimisation. A leg ends at the first of its limits; at least one must be set.");
  s.integer("train.batch", 8, "views per step", {1, 1024});
  s.integer(
       "train.memory_mib", 0,
       "most device memory of a step, its weights and moments included; values are computed again instead of kept, "
       "with the same results; 0: no limit",
       {0, 1e7})
      .aside();
  s.integer("train.steps", 0, "end after so many steps; 0: no such limit", {0, 1e12});
  s.real("train.epochs", 0, "end after so many passes over the views; 0: no such limit", {0, 1e9});
  s.real("train.minutes", 0,
         "end after so many minutes of training; 0: no such limit. On a CPU they are its processor time over its "
         "cores: breaks, other programs and judging do not count. The rate then follows the clock, so two such runs do "
         "not agree bit for bit",
         {0, 1e6});
  s.real("train.rate", 5e-4, "learning rate at the start", {0, 10});
  s.real("train.encoder_rate", 1, "factor of the learning rate for the encoder (maps)", {0, 10});
  s.text("train.schedule", "cosine", "how the rate falls over the leg", {"cosine", "step", "constant"});
  s.real("train.rate_factor", 0.5, "step: what the rate is multiplied by", {0, 1});
  s.real("train.rate_every", 0.25, "step: after each such part of the leg", {1e-6, 1});
  s.real("train.rate_least", 0.02, "cosine: part of the rate that remains at the end", {0, 1});
  s.integer("train.warmup", 0, "steps over which the rate rises from 0", {0, 1e9});
  s.real("train.beta1", 0.5, "Adam: decay of the mean gradient", {0, 0.999999});
  s.real("train.beta2", 0.999, "Adam: decay of the mean square", {0, 0.999999});
  s.real("train.runaway", 1e4,
         "the leg ends as diverged when the mean loss of log.every steps is so many times the least such mean before; "
         "0: never",
         {0, 1e30})
      .aside();
  s.real("train.average", 0,
         "part of a moving average of the weights that a step keeps; what is judged and kept is then that average; 0: "
         "the weights themselves",
         {0, 0.999999});
}

void add_loss_keys(Schema& s) {
  s.section("loss", "Weights of the terms; their sum is minimised. A weight of 0 leaves the term's target unlearned.");
  const double none = std::numeric_limits<double>::infinity();
  s.text(
      "loss.terms", "zhu",
      "maps: the terms of albedo, normal, material and depth: of Zhu et al. 2022, or of Li et al. 2020: squared errors",
      {"zhu", "li2020"});
  s.real("loss.albedo", 1, "log-space squared error of albedo", {0, none});
  s.real("loss.normal", 1, "1 - cosine of normals", {0, none});
  s.real("loss.material", 1, "squared error of roughness and metallic", {0, none});
  s.real("loss.metallic", 0, "cross-entropy of metallic, for metal is rare; beyond the paper", {0, none});
  s.real("loss.depth", 1, "log-space squared error of depth after one scale per image", {0, none});
  s.real("loss.log_depth", 0, "squared error of ln depth, most of each image's mean removed (Eigen et al. 2014)",
         {0, none});
  s.real("loss.depth_detail", 0, "absolute error of ln depth's detail at four scales; beyond the paper", {0, none})
      .later();
  s.real("loss.albedo_detail", 0, "the same of ln(1 + albedo)", {0, none}).later();
  s.real("loss.judgements", 1, "what people say of albedo in the photographs of finetune.iiw", {0, none}).later();
  s.real("loss.scale", 1, "squared error of ln scene_scale (its head sees detached features)", {0, none});
  s.real("loss.perceptual", 0.02, "distance of features of maps, where loss.perceptual_features has any", {0, none});
  s.text(
       "loss.perceptual_features", "",
       "maps: what the perceptual term looks through: VGG16 with random weights, the same for a run.seed; the encoder "
       "of an MGNet that has learned on rooms; VGG16 with imported weights; empty: imported where "
       "loss.perceptual_weights names a file, else no such term",
       {"", "random", "rooms", "imported"})
      .later();
  s.text("loss.perceptual_weights", "",
         "file of these features: rooms: weights of maps; imported: ImageNet weights of VGG16, as `weights import` "
         "wrote them");

  s.real("loss.mixed", 1, "light: radiance of rays that hit, both nets mixed by their uncertainty", {0, none});
  s.real("loss.out_of_view", 1, "light: radiance of all rays, the out-of-view net alone", {0, none});
  s.real("loss.unseen", 0,
         "light: radiance of the out-of-view net alone, rays weighed by their uncertainty: by how much it is asked for",
         {0, none})
      .later();
  s.real("loss.irradiance", 0, "light: Poisson's divergence of the mean radiance of each row of rays, both nets mixed",
         {0, none});
  s.real("loss.rerender", 0.1, "light: squared error of the picture rendered again", {0, none});

  s.text("loss.radiance", "hdr",
         "light: how radiance is compared: RawNeRF's loss, as in the paper, or logarithms and relative error",
         {"hdr", "relative"});
}

void add_light_keys(Schema& s) {
  s.section("light", "The light's nets and what they are shown (model.kind = light).");
  s.text(
      "light.net", "zhu",
      "whose: LightNet and the net out of view, after Zhu et al. 2022, or the one of Li et al. 2020, which has none of "
      "the sizes below, is compared by losses of its own (loss.radiance is not read) and knows no free probes",
      {"zhu", "li2020"});
  s.text("light.output", "", "how LightNet's last number becomes radiance; empty: the preset's",
         {"", "released", "softplus", "exp", "residual"});
  s.text("light.delta", "linear",
         "what the uncertainty of a hit is measured in; whoever asks the nets has to use the same",
         {"linear", "window"});
  s.integer("light.width", 0, "numbers of a hidden layer of LightNet's MLP, a multiple of 16; 0: the preset's",
            {0, kMostMlpWidth});
  s.integer("light.layers", 0, "its hidden layers; 0: the preset's", {0, 64});
  s.integer("light.frequencies", 0, "of each of its encodings; 0: the preset's", {0, kMostMlpFrequencies});
  s.real("light.direction_deviation", 0, "of LightNet's frequencies of directions, cycles per unit; 0: the preset's",
         {0, 1e3});
  s.real("light.surface_deviation", 0, "of its frequencies of normals, colours and roughness; 0: the preset's",
         {0, 1e3});
  s.text("light.out_of_view", "", "form of the light out of view; empty: the preset's", {"", "field", "shells"});
  s.flag("light.sees_maps", false, "the net out of view also reads albedo, normals, material and depth");
  s.flag("light.background", false, "what the field lets through meets a colour that the photograph decides");
  s.integer("light.shells", 0, "painted spheres of that form; 0: the preset's", {0, 64});
  s.integer("light.segments", 0, "samples along a ray of the out-of-view field; 0: the preset's", {0, 1024});
  s.integers("light.field", {}, "hidden layers of the field, at most four; empty: the preset's", {1, kMostFieldWidth});
  s.text("light.maps", "true",
         "maps that the nets see: the truth, what MGNet says of each picture, or one or the other by chance",
         {"true", "predicted", "both"});
  s.text("light.maps_weights", "", "weights of that MGNet; empty: the shipped ones");
  s.integer("light.rows", 64, "points of a view whose light is compared", {1, 65536});
  s.integer("light.samples", 64, "directions from each, a multiple of 16", {16, 128});
  s.real("light.probe_rows", 0.2, "share of the points that are free probes, where a view has any", {0, 1});
  s.real("light.clipped", 0.5, "share of views whose picture is clamped to [0, 1], as a photograph is", {0, 1});
  s.flag("light.ldr", false,
         "clamp the light that is learned, and the pictures, to [0, 1]: what a photograph can tell");
  s.integer("light.shade_width", 32, "columns of the grid of pixels that are rendered again", {1, 4096});
  s.integer("light.shade_height", 24, "its rows", {1, 4096});
  s.integer("light.shade_samples", 16, "directions of each, a multiple of 16", {16, 65536});
}

void add_log_keys(Schema& s) {
  s.section("log", "How often things are written. Steps; 0: never.");
  s.integer("log.every", 20, "training losses into metrics.jsonl", {0, 1e9}).aside();
  s.integer("log.validate_every", 500, "validation; also at the end", {0, 1e9}).aside();
  s.integer("log.checkpoint_every", 500, "checkpoint; also at the end and when interrupted", {0, 1e9}).aside();
  s.real("log.checkpoint_minutes", 5, "also a checkpoint when so many minutes passed since the last; 0: not", {0, 1e6})
      .aside();
}

Schema make_schema() {
  Schema s;
  add_run_keys(s), add_model_keys(s), add_data_keys(s), add_stream_keys(s), add_finetune_keys(s), add_train_keys(s),
      add_loss_keys(s), add_light_keys(s), add_log_keys(s);
  return s;
}

}  // namespace

const Schema& training_schema() {
  static const Schema schema = make_schema();
  return schema;
}

}  // namespace clerestory
