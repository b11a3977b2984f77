#include "experiments/training/judged_views.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {

using nlohmann::json;

JudgedErrors judged_errors(const std::string& view, std::vector<double> errors) {
  const std::filesystem::path path(view);
  return {path.parent_path().filename().string(), path.filename().string(), std::move(errors)};
}

void write_judged_errors(const std::filesystem::path& file, const std::vector<JudgedErrorsList>& lists) {
  json all = json::array();
  for (const JudgedErrorsList& list : lists) {
    json views = json::array();
    for (const JudgedErrors& v : list.views)  // NaN becomes null
      views.push_back({{"room", v.room}, {"view", v.view}, {"errors", v.errors}});
    all.push_back({{"list", list.list}, {"views", std::move(views)}});
  }
  write_file(file, all.dump() + "\n");
}

std::vector<JudgedErrorsList> read_judged_errors(const std::filesystem::path& file) {
  const auto number = [](const json& value) {
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
  };
  try {
    std::vector<JudgedErrorsList> lists;
    for (const json& l : parse_json(read_file(file), file.string())) {
      JudgedErrorsList& list = lists.emplace_back();
      list.list = l.at("list");
      for (const json& v : l.at("views")) {
        JudgedErrors& view = list.views.emplace_back();
        view.room = v.at("room"), view.view = v.at("view");
        for (const json& e : v.at("errors")) view.errors.push_back(number(e));
      }
    }
    return lists;
  } catch (const json::exception& e) {
    throw usage_error("errors by view cannot be read", file.string(), e.what(), "what `clerestory train` wrote");
  }
}

}  // namespace clerestory
