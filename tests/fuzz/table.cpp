// A table, in all its dresses.
#include "host/report/table.hpp"

#include "host/io/files.hpp"
#include "host/report/html.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("table", "table.json", [](const std::filesystem::path& file) {
  const Table table = table_from_json(read_file(file, 1 << 20, true), file.string());
  table_text(table), table_markdown(table), table_from_json(table_json(table), file.string());
});

}  // namespace clerestory
