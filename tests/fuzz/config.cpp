// A config, read again from what is written of it.
#include "host/io/config.hpp"

#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("config", "config.toml", [](const std::filesystem::path& file) {
  Schema schema;
  schema.flag("a.flag", true, "A flag.").integer("a.integer", 1, "A number.", {0, 9}).real("a.real", 1, "A number.");
  schema.text("b.text", "one", "A text.", {"one", "two"})
      .texts("b.texts", {}, "Texts.")
      .reals("b.reals", {}, "Numbers.");
  schema.integers("c.integers", {}, "Numbers.").real("c.*", 0, "A number of any name.");
  const Config config = load_config(file, schema);
  parse_config(config_toml(config), file.string(), schema);
});

}  // namespace clerestory
