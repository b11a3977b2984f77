// JSON with this project's errors. Heavy (nlohmann): include it in .cpp files only.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace clerestory {

/// Throws usage_error naming `where` and the place of the mistake, or of a nesting that is too deep (nesting.hpp).
nlohmann::json parse_json(std::string_view text, const std::string& where);

/// Parses text that must be a JSON object.
nlohmann::json parse_json_object(std::string_view text, const std::string& where);

/// Reads a file of at most 64 MiB that holds a JSON object.
nlohmann::json read_json_object(const std::filesystem::path& path);

/// Text of a value for a message, cut after some 60 characters.
std::string brief(const nlohmann::json& value);

}  // namespace clerestory
