#include "experiments/commands/edit.hpp"

#include <cstdio>

#include "experiments/applications/edit.hpp"
#include "experiments/applications/light_weights.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/commands/cli.hpp"
#include "host/report/progress.hpp"

namespace clerestory {

void add_edit_command(CommandLine& line) {
  const auto options = std::make_shared<EditOptions>();
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
      .option("--bounces", "N", "Bounces of light that follow the edit", options->bounces)
      .option("--out", "DIR", "Folder of results; RUN/edit without it", options->out)
      .flag("--force", "Replace a folder that holds other files or results made from it: they are given up",
            options->force)
      .common({Common::Device, Common::Seed, Common::Spp, Common::Json, Common::Quiet})
      .light(lights_to_choose(), options->lit_by.weights, options->lit_by.lamps)
      .notes(
          "What is not given stays as it is:\n"
          "  clerestory edit runs/invert/office --mask floor.png --albedo 0.9,0.9,0.9 --roughness 0.02 --metallic 1\n" +
          lights_note());
  command.run([options](const CommonOptions& common) {
    if (options->mask.empty()) throw usage_error("a mask is needed", "--mask", "none", "a picture of the run's size");
    options->device = common.device, options->command = common.command;
    options->render.seed = static_cast<std::uint32_t>(common.seed);
    choose_light(options->render, options->lit_by, common.light, was_given(common, "--light"));
    if (common.spp) options->render.spp = static_cast<int>(*common.spp);
    catch_interrupts();
    const std::string summary = edit(*options);
    refresh_run_report(options->run, options->out.empty() ? options->run / "edit" : options->out);
    write_json_result(common, summary);
  });
}

}  // namespace clerestory
