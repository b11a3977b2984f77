// JSON with this project's errors. Heavy (nlohmann): include it in .cpp files only.
#pragma once
#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "host/error.hpp"

namespace clerestory {

/// Throws usage_error naming `where` and the place of the mistake, or of a nesting that is too deep (nesting.hpp).
nlohmann::json parse_json(std::string_view text, const std::string& where);

/// Parses text that must be a JSON object.
nlohmann::json parse_json_object(std::string_view text, const std::string& where);

/// Reads a file of at most 64 MiB that holds a JSON object.
nlohmann::json read_json_object(const std::filesystem::path& path);

/// The value as a whole number, which get<T>() would bend until it fits. Throws usage_error naming `where` and the key.
template <class T, class Json>
T whole_number(const Json& value, const std::string& key, const std::string& where);

/// For a file or stdout. What is not UTF-8, as paths and names of drivers may be, becomes U+FFFD.
template <class Json>
std::string json_text(const Json& value, int indent = 1) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// Text of a value for a message, cut after some 60 characters.
std::string brief(const nlohmann::json& value);

template <class T, class Json>
T whole_number(const Json& value, const std::string& key, const std::string& where) {
  using Limits = std::numeric_limits<T>;
  const bool fits = value.is_number_unsigned()
                        ? std::in_range<T>(value.template get<std::uint64_t>())
                        : value.is_number_integer() && std::in_range<T>(value.template get<std::int64_t>());
  if (!fits)
    throw usage_error(fmt::format("wrong value of {}", key), where, brief(value),
                      fmt::format("a whole number from {} to {}", Limits::min(), Limits::max()));
  return value.template get<T>();
}

}  // namespace clerestory
