// The list of a view's probes, one of which has its panorama.
#include "host/io/files.hpp"
#include "host/io/light_files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("probes", "000_probes.json", [](const std::filesystem::path& file) {
  Probe none;
  none.distance = 1, none.radiance = Image(probe_width, probe_height, 3);
  const std::string list = read_file(file);
  write_probes(file.parent_path(), "000", {none});  // so that a panorama is there
  write_file(file, list);
  read_probes(file.parent_path(), "000");
});

}  // namespace clerestory
