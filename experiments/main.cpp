// The program: every command, in the order of --help.
#include "experiments/commands/bench.hpp"
#include "experiments/commands/check.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/data.hpp"
#include "experiments/commands/devices.hpp"
#include "experiments/commands/edit.hpp"
#include "experiments/commands/evaluate.hpp"
#include "experiments/commands/generate.hpp"
#include "experiments/commands/insert.hpp"
#include "experiments/commands/invert.hpp"
#include "experiments/commands/light.hpp"
#include "experiments/commands/replay.hpp"
#include "experiments/commands/report.hpp"
#include "experiments/commands/results.hpp"
#include "experiments/commands/run.hpp"
#include "experiments/commands/train.hpp"
#include "experiments/commands/tune.hpp"
#include "experiments/commands/weights.hpp"

int main(int argc, char** argv) {
  clerestory::CommandLine line;
  clerestory::add_invert_command(line);
  clerestory::add_insert_command(line);
  clerestory::add_edit_command(line);
  clerestory::add_light_command(line);
  clerestory::add_generate_command(line);
  clerestory::add_data_commands(line);
  clerestory::add_train_command(line);
  clerestory::add_evaluate_command(line);
  clerestory::add_weights_commands(line);
  clerestory::add_replay_command(line);
  clerestory::add_report_command(line);
  clerestory::add_bench_command(line);
  clerestory::add_run_command(line);
  clerestory::add_results_commands(line);
  clerestory::add_check_command(line);
  clerestory::add_devices_command(line);
  clerestory::add_tune_command(line);
  return line.run(argc, argv);
}
