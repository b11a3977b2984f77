#include "experiments/commands/tune.hpp"

#include <cstdio>
#include <memory>

#include "experiments/bench/tune.hpp"
#include "experiments/commands/cli.hpp"
#include "host/report/progress.hpp"
#include "host/report/terminal.hpp"
#include "host/tuning/tuning.hpp"

namespace clerestory {
namespace {

struct TuneCommand {
  double minutes = 20;
  bool again = false, show = false;
};

std::optional<TuningInUse> finished(const Device& device) {
  auto used = tuning_in_use(device);
  if (used && !used->shipped && is_finished(used->tuning)) return used;
  return {};
}

TuningInUse tuned(Device& device, const TuneCommand& command) {
  if (!command.again)
    if (const auto done = finished(device)) {
      say("tune: this device is tuned; --again measures anew");
      return *done;
    }
  TuneOptions options = tune_options();
  options.minutes = command.minutes, options.again = command.again;
  return {tune(device, options), tuning_file(), false};
}

}  // namespace

void add_tune_command(CommandLine& line) {
  auto command = std::make_shared<TuneCommand>();
  line.add("tune", "Measure CLBlast's parameters on a device, and whether it or our kernels are faster there")
      .option(
          "--minutes", "M", "Takes no longer than this; a search that is not over goes on at the next call",
          [command](const std::string& text) {
            read_value(text, "--minutes", command->minutes);
            if (command->minutes <= 0) throw usage_error("no time to measure in", "--minutes", text, "more than 0");
          },
          "20")
      .flag("--again", "Forgets what was measured on this device and begins anew", command->again)
      .flag("--show", "Measures nothing: prints what is in use", command->show)
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes(
          "Results lie in $XDG_DATA_HOME/clerestory/tuning.json, else in ~/.local/share/clerestory. --gemm auto and\n"
          "CLBlast's products follow them.")
      .run([command](const CommonOptions& common) {
        if (command->show && command->again) throw usage_error("measures nothing", "--show", "--again", "one of them");
        catch_interrupts();
        Device device = Device::open(common.device);
        const auto used = command->show ? tuning_in_use(device) : std::optional(tuned(device, *command));
        if (!used)
          throw usage_error("nothing was measured on this device, and nothing came for it", "--show",
                            device.info().name, "`clerestory tune` before");
        if (common.json) write_json_result(common, tuning_json(used->tuning));
        if (!common.json || !common.json->empty()) std::fputs(terminal_text(tuning_text(*used)).c_str(), stdout);
      });
}

}  // namespace clerestory
