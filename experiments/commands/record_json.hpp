// --json of commands whose result has a record.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace clerestory {

/// Where results lie, by name, and the facts and figures of their record (host/report/provenance.hpp).
std::string record_json(const std::vector<std::pair<std::string, std::filesystem::path>>& results,
                        const std::filesystem::path& record);

}  // namespace clerestory
