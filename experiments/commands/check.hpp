#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory check`: whether a device computes every op rightly, and how exactly.
void add_check_command(CommandLine& line);

}  // namespace clerestory
