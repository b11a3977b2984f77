// Provenance, and what of its folder it claims.
#include "host/report/provenance.hpp"

#include "host/report/own_files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("provenance", "provenance.json", [](const std::filesystem::path& file) {
  write_provenance(file, read_provenance(file));
  foreign_in(file.parent_path());
});

}  // namespace clerestory
