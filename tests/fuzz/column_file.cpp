// What rooms are packed into, with the hash that a fuzzer would not find.
#include "tracer/column_file.hpp"

#include <fmt/format.h>

#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {
namespace {

const FuzzTarget target("column_file", "packed.rooms", [](const std::filesystem::path& file) {
  const std::string bytes = read_file(file, 1 << 20, true);
  write_file(file, bytes + fmt::format("\nhash {:016x}\n", content_hash(bytes)));
  ColumnReader from(file);
  from.names("names");
  from.column<double>("reals");
  from.end();
});

}  // namespace
}  // namespace clerestory
