// `clerestory replay`.
#pragma once

namespace clerestory {

class CommandLine;
void add_replay_command(CommandLine& line);

}  // namespace clerestory
