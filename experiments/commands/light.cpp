#include "experiments/commands/light.hpp"

#include "experiments/applications/light.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/method_option.hpp"
#include "host/report/progress.hpp"

namespace clerestory {

void add_light_command(CommandLine& line) {
  const auto options = std::make_shared<LightOptions>();
  Command command = line.add("light", "The light that arrives at any point of a run, as a panorama");
  command.argument("RUN", "Folder that invert wrote", options->run)
      .option("--at-point", "X,Y,Z", "The point, camera metres",
              [options](const std::string& text) {
                const std::vector<double> p = read_numbers(text, "--at-point", 3);
                options->at_point = {p[0], p[1], p[2]};
              })
      .option("--at", "X,Y", "The point just above the surface at this pixel",
              [options](const std::string& text) {
                const std::vector<double> p = read_numbers(text, "--at", 2);
                options->at = {p[0], p[1]};
              })
      .option(
          "--size", "WxH", "Of the panorama",
          [options](const std::string& text) {
            PixelSize size;
            read_value(text, "--size", size);
            options->size = {size.width, size.height};
          },
          "256x128")
      .option("--out", "FILE.exr", "Panorama in the photograph's unit, a PNG beside it; default: RUN/light.exr",
              options->out)
      .flag("--force", "Replace files of these names that `light` did not write", options->force)
      .light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .common({Common::Device, Common::Seed, Common::Gemm, Common::Json, Common::Quiet})
      .notes(
          "Prints where the panorama lies. Equirectangular in camera axes: the centre column looks along -z, the right "
          "quarter along +x, the top row "
          "along +y.\nA point behind the camera or hidden by what the picture shows has light as well; one beyond "
          "three "
          "times the depth of the room is refused.\n" +
          lights_note());
  command.run([options](const CommonOptions& common) {
    options->device = common.device, options->gemm = common.gemm, options->command = common.command;
    options->json = common.json.value_or("");
    options->render.seed = render_seed(common);
    take_method(common, options->render, options->lit_by);
    catch_interrupts();
    const std::string summary = light(*options);
    const std::filesystem::path out = options->out.empty() ? options->run / "light.exr" : options->out;
    refresh_run_report(options->run, out);
    print_result(common, out, summary);
  });
}

}  // namespace clerestory
