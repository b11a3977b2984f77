// Progress of a render by chunks of its rays.
#pragma once
#include <string>

#include "host/graph/op.hpp"

namespace clerestory {

/// For RenderSettings::after_chunk: a bar on the terminal for every pass over the picture, and the end of the work
/// after an interrupt.
ChunkListener chunk_progress(const std::string& label);

}  // namespace clerestory
