#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory tune`: CLBlast's parameters and the faster matrix products of a device, measured and kept.
void add_tune_command(CommandLine& line);

}  // namespace clerestory
