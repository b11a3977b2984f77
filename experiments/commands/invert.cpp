#include "experiments/commands/invert.hpp"

#include "experiments/applications/invert.hpp"
#include "experiments/applications/light_weights.hpp"
#include "experiments/commands/cli.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr int kFirstRound = 16;  // samples a pixel

double goal_of(const std::optional<double>& given, const char* name) {
  if (given && !(*given > 0))
    throw usage_error("is no goal of a re-render", name, fmt::format("{}", *given), "above 0");
  return given.value_or(0);
}

}  // namespace

void add_invert_command(CommandLine& line) {
  const auto options = std::make_shared<InvertOptions>();
  const auto error = std::make_shared<std::optional<double>>(), seconds = std::make_shared<std::optional<double>>();
  Command command = line.add("invert", "Take a photograph of a room apart and render it again");
  command.argument("PHOTO", "PNG, JPEG, EXR or HDR", options->photo)
      .option("--fov", "DEGREES",
              "Horizontal field of view; without it and --camera what EXIF says, else 65 across the longer side",
              options->fov)
      .option("--camera", "FILE", "camera.json with fx, fy, cx, cy", options->camera)
      .option("--gbuffer", "DIR|ROOM/NNN", "Maps that replace predicted ones: a folder of a run, or a generated view",
              options->gbuffer)
      .option("--only", "MAPS", "albedo,normal,depth,material: these maps and no re-render",
              [options](const std::string& text) { options->only = read_names(text, "--only"); })
      .option("--depth-scale", "METRES", "99th percentile of depth", options->depth_scale)
      .option("--known", "X,Y,METRES", "Depth at one pixel, which sets the scale of all",
              [options](const std::string& text) {
                const std::vector<double> v = read_numbers(text, "--known", 3);
                options->known = KnownDepth{v[0], v[1], v[2]};
              })
      .option("--out", "DIR",
              "RUN folder; without it runs/invert/<stem of the photo>, or a longer name if that is another's",
              options->out)
      .flag("--force", "Replace a RUN folder that holds other files or results made from it: they are given up",
            options->force)
      .choice("--sampler", "How directions are drawn", options->render.sampler,
              {"vndf_caps", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform", "grid8x16"})
      .choice("--points", "Which numbers draw them", options->render.points, {"sobol", "independent"})
      .choice("--ssrt", "How rays march over the depth map", options->render.ssrt, {"hierarchical", "dda"})
      .choice("--delta",
              "What the uncertainty of a hit is measured in; learned light only takes what it was trained with",
              options->render.delta, {"linear", "window"})
      .option("--thickness", "METRES", "How far behind a surface a ray passes unseen; 0: surfaces have no back",
              options->render.thickness)
      .option("--target-error", "E", "Samples in rounds until the re-render's root relMSE is measured below this",
              *error)
      .option("--seconds", "S", "Samples in rounds for so long", *seconds)
      .light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .common({Common::Device, Common::Seed, Common::Spp, Common::Weights, Common::Preset, Common::Gemm, Common::Tile,
               Common::Quiet})
      .notes(
          "The camera looks along -z, x right, y up; depth is axial, in metres. docs/commands.md says what the RUN "
          "folder holds.\n" +
          lights_note());
  command.run([options, error, seconds](const CommonOptions& common) {
    options->device = common.device, options->gemm = common.gemm, options->tile = common.tile,
    options->preset = common.preset, options->weights = common.weights;
    options->command = common.command;
    options->render.seed = static_cast<std::uint32_t>(common.seed);
    choose_light(options->render, options->lit_by, common.light, was_given(common, "--light"));
    if (*error || *seconds) {
      options->goal = RenderGoal{goal_of(*error, "--target-error"), goal_of(*seconds, "--seconds")};
      options->render.spp = kFirstRound;
    }
    if (common.spp) options->render.spp = static_cast<int>(*common.spp);
    catch_interrupts();
    const std::filesystem::path out = invert(*options);
    say("report: " + (out / "report.html").string());
  });
}

}  // namespace clerestory
