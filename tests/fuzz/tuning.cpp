// What `clerestory tune` has measured, read again from what is written of it.
#include "host/tuning/tuning.hpp"

#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("tuning", "tuning.json", [](const std::filesystem::path& file) {
  std::string list;
  for (const Tuning& tuning : read_tunings(file)) list += (list.empty() ? "" : ",") + tuning_json(tuning);
  write_file(file, "{\"tunings\": [" + list + "]}");
  read_tunings(file);
});

}  // namespace clerestory
