// The manifest of a data set, read again from what is written of it.
#include "tracer/manifest.hpp"

#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("manifest", "set.toml", [](const std::filesystem::path& file) {
  write_file(file, manifest_text(read_manifest(file)));
  read_manifest(file);
});

}  // namespace clerestory
