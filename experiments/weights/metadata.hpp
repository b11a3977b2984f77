// Facts in the metadata of checkpoints and weights.
#pragma once
#include <string>

#include "host/io/safetensors.hpp"

namespace clerestory {

/// Throws usage_error naming `where` and the key that is missing.
const std::string& fact(const TensorFile& file, const std::string& key, const std::string& where);
/// A whole number from `least` to `most`. Throws usage_error naming `where`, key, value and bounds.
int whole_fact(const TensorFile& file, const std::string& key, const std::string& where, int least, int most);
/// A number from `least` to `most`. Throws as whole_fact().
double real_fact(const TensorFile& file, const std::string& key, const std::string& where, double least, double most);

}  // namespace clerestory
