// What `clerestory tune` has measured, read again from what is written of it.
#include "host/tuning/tuning.hpp"

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("tuning", "tuning.json", [](const std::filesystem::path& file) {
  std::vector<std::string> tunings;
  for (const Tuning& tuning : read_tunings(file)) tunings.push_back(tuning_json(tuning));
  write_file(file, fmt::format("{{\"tunings\": [{}]}}", fmt::join(tunings, ",")));
  read_tunings(file);
});

}  // namespace clerestory
