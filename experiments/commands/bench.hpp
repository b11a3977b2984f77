#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory bench [FAMILY ...]`: speeds of kernels beside what the device can do, measured in the same run.
void add_bench_command(CommandLine& line);

}  // namespace clerestory
