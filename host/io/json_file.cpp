#include "host/io/json_file.hpp"

#include <string>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/nesting.hpp"

namespace clerestory {

nlohmann::json parse_json(std::string_view text, const std::string& where) {
  check_nesting(text, where);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    const std::string why = error.what();  // "[json.exception.parse_error.101] parse error at line 1..."
    throw usage_error("is no valid JSON: " + why.substr(why.find(']') + 2), where);
  }
}

nlohmann::json parse_json_object(std::string_view text, const std::string& where) {
  nlohmann::json value = parse_json(text, where);
  if (!value.is_object()) throw usage_error("wrong JSON", where, brief(value), "an object");
  return value;
}

nlohmann::json read_json_object(const std::filesystem::path& path) {
  return parse_json_object(read_file(path, std::uint64_t{1} << 26), path.string());
}

std::string brief(const nlohmann::json& value) {
  std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

}  // namespace clerestory
