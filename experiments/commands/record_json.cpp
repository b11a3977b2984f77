#include "experiments/commands/record_json.hpp"

#include <nlohmann/json.hpp>

#include "host/report/provenance.hpp"

namespace clerestory {

std::string record_json(const std::vector<std::pair<std::string, std::filesystem::path>>& results,
                        const std::filesystem::path& record) {
  const Provenance made = read_provenance(record);
  nlohmann::ordered_json json;
  for (const auto& [name, path] : results) json[name] = path.string();
  json["facts"] = made.facts, json["figures"] = made.figures;
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);  // paths need not be UTF-8
}

}  // namespace clerestory
