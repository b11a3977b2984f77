#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory generate`: rooms with pictures, maps, cameras and balls (tracer/generate.hpp).
void add_generate_command(CommandLine& line);

}  // namespace clerestory
