#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory light RUN`: incident light at a point as a panorama.
void add_light_command(CommandLine& line);

}  // namespace clerestory
