#include "experiments/commands/invert.hpp"

#include "experiments/applications/invert.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/method_option.hpp"
#include "experiments/commands/record_json.hpp"
#include "experiments/commands/sample_options.hpp"
#include "host/io/data_files.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {

void add_invert_command(CommandLine& line) {
  const auto options = std::make_shared<InvertOptions>();
  const auto samples = std::make_shared<SampleOptions>();
  const auto every_ray = std::make_shared<bool>(false), everything = std::make_shared<bool>(false);
  const auto precision = std::make_shared<std::string>("single");
  Command command = line.add("invert", "Take a photograph of a room apart and render it again");
  command.argument("PHOTO", "PNG, JPEG, EXR or HDR", options->photo)
      .option("--fov", "DEGREES", "Horizontal field of view; default: what EXIF says, else 65 across the longer side",
              options->fov)
      .option("--camera", "FILE", "camera.json with width, height, fx, fy, cx, cy in pixels", options->camera)
      .option("--gbuffer", "DIR|ROOM/NNN",
              "Maps to use in place of predicted ones: a folder of a run, or a generated view", options->gbuffer)
      .option("--only", "MAPS", "Of albedo,normal,depth,material these maps alone, and no re-render",
              [options](const std::string& text) { options->only = read_names(text, "--only"); })
      .option("--depth-scale", "METRES", "Sets the scale: the 99th percentile of depth", options->depth_scale)
      .option("--known", "X,Y,METRES", "A depth that you measured at one pixel; it sets the scale of all",
              [options](const std::string& text) {
                const std::vector<double> v = read_numbers(text, "--known", 3);
                options->known = KnownDepth{v[0], v[1], v[2]};
              })
      .option(
          "--out", "DIR",
          "RUN folder; default: runs/invert/<stem of the photo>, or a longer name where that is another photograph's",
          options->out)
      .flag("--force", "Replace a RUN folder even if it holds other files, or results made from it: they are lost",
            options->force);
  add_sample_options(command, options->render, *samples, "the re-render", {"grid8x16"});
  command
      .option("--mask", "M.png",
              "Picture of the photograph's size: the error is that where a channel is above one half", options->mask)
      .choice("--points", "Random numbers that draw the directions: Sobol's points, or independent ones",
              options->render.points, {"sobol", "independent"})
      .choice("--ssrt", "How rays march over the depth map", options->render.ssrt, {"hierarchical", "dda"})
      .choice("--delta",
              "What the uncertainty of a hit is measured in; learned light only takes what it was trained with",
              options->render.delta, {"linear", "window"})
      .option("--thickness", "METRES", "How far behind a surface a ray passes unseen; 0: surfaces have no back",
              options->render.thickness)
      .flag("--every-ray", "The light's nets answer each ray by itself: rays that come the same way share no answer",
            *every_ray)
      .flag("--everything", "Leave nothing out of the re-render, whatever the scene lacks", *everything)
      .flag("--measure", "Time what is left out: a part of the rays is rendered with it, for the report",
            options->measure)
      .choice("--precision", "Of all kernels: double is slow, and shows what float gets wrong", *precision,
              {"single", "double"})
      .light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .common({Common::Device, Common::Seed, Common::Spp, Common::Weights, Common::Preset, Common::Gemm, Common::Tile,
               Common::Json, Common::Quiet})
      .notes(
          "Prints the RUN folder. The camera looks along -z, x right, y up; depth is axial, in metres. "
          "docs/commands.md says what the RUN "
          "folder holds.\n" +
          lights_note());
  command.run([options, samples, every_ray, everything, precision](const CommonOptions& common) {
    options->photo = found_data(options->photo);
    if (!options->camera.empty()) options->camera = found_data(options->camera);
    if (!options->mask.empty()) options->mask = found_data(options->mask);
    options->device = common.device, options->gemm = common.gemm, options->tile = common.tile,
    options->preset = common.preset;
    options->command = common.command;
    options->render.seed = render_seed(common);
    options->weights = take_method(common, options->render, options->lit_by);
    options->goal = take_samples(common, *samples, options->render);
    if (*every_ray) {
      if (options->render.light != "net")
        throw usage_error("no net answers rays one by one there", "--every-ray", "--light " + options->render.light,
                          "--light net");
      options->render.sharing = Sharing::Never;
    }
    if (*everything) options->render.leave_out.clear();
    if (*precision == "double") options->render.precision = Precision::Double;
    catch_interrupts();
    const std::filesystem::path out = invert(*options);
    const std::filesystem::path report = out / "report.html";
    say("report: " + report.string());
    print_result(common, out, record_json({{"run", out}, {"report", report}}, out / kProvenanceName));
  });
}

}  // namespace clerestory
