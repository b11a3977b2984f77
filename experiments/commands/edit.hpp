#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory edit RUN`: the material under a mask replaced in the photograph of a run.
void add_edit_command(CommandLine& line);

}  // namespace clerestory
