#include "experiments/commands/edit.hpp"

#include <cstdio>

#include "experiments/applications/edit.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/method_option.hpp"
#include "experiments/commands/sample_options.hpp"
#include "host/io/data_files.hpp"
#include "host/report/progress.hpp"

namespace clerestory {

void add_edit_command(CommandLine& line) {
  const auto options = std::make_shared<EditOptions>();
  const auto samples = std::make_shared<SampleOptions>();
  Command command = line.add("edit", "Replace the material under a mask in the photograph of a run");
  command.argument("RUN", "Folder that invert wrote", options->run)
      .option("--mask", "M.png", "Picture of the run's size: edited where a channel is above one half", options->mask)
      .option("--albedo", "R,G,B", "Linear base colour",
              [options](const std::string& text) {
                const std::vector<double> rgb = read_numbers(text, "--albedo", 3);
                options->change.albedo = {rgb[0], rgb[1], rgb[2]};
              })
      .option("--roughness", "R", "Perceptual roughness", options->change.roughness)
      .option("--metallic", "M", "1 for metal", options->change.metallic)
      .option("--bounces", "N", "How many bounces of light follow the edit", options->bounces)
      .option("--out", "DIR", "Folder of results, which is a run as well; default: RUN/edit", options->out)
      .flag("--force", "Replace that folder even if it holds other files, or results made from it: they are lost",
            options->force);
  add_sample_options(command, options->render, *samples, "what the edited pixels show");
  command.common({Common::Device, Common::Seed, Common::Spp, Common::Gemm, Common::Json, Common::Quiet})
      .light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .notes(
          "What is not given stays as it is. Prints the folder of results.\n"
          "  clerestory edit runs/invert/office --mask floor.png --albedo 0.9,0.9,0.9 --roughness 0.02 --metallic 1\n" +
          lights_note());
  command.run([options, samples](const CommonOptions& common) {
    if (options->mask.empty()) throw usage_error("a mask is needed", "--mask", "none", "a picture of the run's size");
    options->mask = found_data(options->mask);
    options->device = common.device, options->gemm = common.gemm, options->command = common.command;
    options->render.seed = render_seed(common);
    take_method(common, options->render, options->lit_by);
    options->goal = take_samples(common, *samples, options->render);
    catch_interrupts();
    const std::string summary = edit(*options);
    const std::filesystem::path out = options->out.empty() ? options->run / "edit" : options->out;
    refresh_run_report(options->run, out);
    print_result(common, out, summary);
  });
}

}  // namespace clerestory
