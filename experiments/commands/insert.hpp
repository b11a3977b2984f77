#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory insert RUN`: balls and meshes put into the photograph of a run.
void add_insert_command(CommandLine& line);

}  // namespace clerestory
