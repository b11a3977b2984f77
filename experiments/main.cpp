// The program: every command, in the order of --help.
#include "experiments/cli.hpp"
#include "experiments/commands/devices.hpp"
#include "experiments/commands/evaluate.hpp"
#include "experiments/commands/train.hpp"

int main(int argc, char** argv) {
  clerestory::CommandLine line;
  clerestory::add_train_command(line);
  clerestory::add_evaluate_command(line);
  clerestory::add_devices_command(line);
  return line.run(argc, argv);
}
