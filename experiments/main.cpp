// The program: every command, in the order of --help.
#include "experiments/cli.hpp"
#include "experiments/commands/devices.hpp"

int main(int argc, char** argv) {
  clerestory::CommandLine line;
  clerestory::add_devices_command(line);
  return line.run(argc, argv);
}
