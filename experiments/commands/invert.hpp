#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory invert PHOTO`: the main job.
void add_invert_command(CommandLine& line);

}  // namespace clerestory
