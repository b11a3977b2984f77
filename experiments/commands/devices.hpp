#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory devices`: every OpenCL device, with what it can do.
void add_devices_command(CommandLine& line);

}  // namespace clerestory
