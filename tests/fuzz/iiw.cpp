// Judgements of pairs of points, read again from what is written of them.
#include "host/io/iiw.hpp"

#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("iiw", "1.json", [](const std::filesystem::path& file) {
  write_judgements(file, read_judgements(file));
  read_judgements(file);
});

}  // namespace clerestory
