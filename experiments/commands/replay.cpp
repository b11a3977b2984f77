#include "experiments/commands/replay.hpp"

#include <cmath>
#include <cstdio>

#include "experiments/applications/replay.hpp"
#include "experiments/commands/cli.hpp"

namespace clerestory {

void add_replay_command(CommandLine& line) {
  const auto options = std::make_shared<ReplayOptions>();
  const auto at = std::make_shared<std::optional<std::string>>();
  line.add("replay", "One sample of a run's re-render taken again, in double beside float, with all on its way")
      .argument("RUN", "Folder that invert wrote", options->run)
      .option("--at", "X,Y", "The pixel, column and row from 0", *at)
      .option("--sample", "N", "Which of its samples, from 0", options->sample)
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes(
          "Prints random numbers, frame, direction, pdf, weight, hit, u, radiance by part and the contribution to the "
          "pixel, of a re-render that `invert` made. A sample that it dropped it names by pixel and number.")
      .run([options, at](const CommonOptions& common) {
        if (!*at) throw usage_error("a pixel is needed", "--at", "none", "X,Y");
        const std::vector<double> v = read_numbers(**at, "--at", 2);
        for (const double number : v)
          if (number != std::floor(number) || std::abs(number) > 1e9)
            throw usage_error("no pixel", "--at", **at, "whole numbers, a column and a row");
        options->x = static_cast<int>(v[0]), options->y = static_cast<int>(v[1]), options->device = common.device;
        const Replayed replayed = replay_of_run(*options);
        if (!common.json || !common.json->empty()) std::fputs(replay_text(replayed).c_str(), stdout);
        write_json_result(common, replay_json(replayed));
      });
}

}  // namespace clerestory
