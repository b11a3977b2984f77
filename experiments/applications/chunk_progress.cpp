#include "experiments/applications/chunk_progress.hpp"

#include <memory>

#include "host/report/progress.hpp"

namespace clerestory {

ChunkListener chunk_progress(const std::string& label) {
  return [label, bar = std::shared_ptr<Progress>()](int done, int chunks) mutable {
    if (!bar) bar = std::make_shared<Progress>(label, chunks, "chunks of rays", done);  // the first built kernels too
    bar->update(done);
    if (done == chunks) bar.reset();
    give_up_if_interrupted(label);
  };
}

}  // namespace clerestory
