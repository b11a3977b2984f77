#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory run CONFIG [key=value ...]`: studies that end in a table.
void add_run_command(CommandLine& line);

}  // namespace clerestory
