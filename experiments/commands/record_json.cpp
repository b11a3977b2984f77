#include "experiments/commands/record_json.hpp"

#include <nlohmann/json.hpp>

#include "host/io/json_file.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {

std::string record_json(const std::vector<std::pair<std::string, std::filesystem::path>>& results,
                        const std::filesystem::path& record) {
  const Provenance made = read_provenance(record);
  nlohmann::ordered_json json;
  for (const auto& [name, path] : results) json[name] = path.string();
  json["facts"] = made.facts, json["figures"] = made.figures;
  return json_text(json, 2);  // paths need not be UTF-8
}

}  // namespace clerestory
