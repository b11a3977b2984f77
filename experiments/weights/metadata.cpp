#include "experiments/weights/metadata.hpp"

#include <cstdlib>

#include "host/error.hpp"

namespace clerestory {

const std::string& fact(const TensorFile& file, const std::string& key, const std::string& where) {
  const auto found = file.metadata.find(key);
  if (found == file.metadata.end())
    throw usage_error("the metadata lack a key", where, "no " + key, "a file written by `clerestory train`");
  return found->second;
}

namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& key, const std::string& text, double least,
                         double most) {
  throw usage_error("a value of the metadata makes no sense", where + ": " + key, text,
                    fmt::format("{} to {}", least, most));
}

}  // namespace

int whole_fact(const TensorFile& file, const std::string& key, const std::string& where, int least, int most) {
  const std::string& text = fact(file, key, where);
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != 0 || value < least || value > most) refuse(where, key, text, least, most);
  return static_cast<int>(value);
}

double real_fact(const TensorFile& file, const std::string& key, const std::string& where, double least, double most) {
  const std::string& text = fact(file, key, where);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != 0 || !(value >= least && value <= most)) refuse(where, key, text, least, most);
  return value;
}

}  // namespace clerestory
