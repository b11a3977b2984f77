#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory results write|check|list|refresh|folder`: the figures in docs/results.
void add_results_commands(CommandLine& line);

}  // namespace clerestory
