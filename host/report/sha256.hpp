// SHA-256, FIPS 180-4: what browsers compare a page's script and style with.
#pragma once
#include <string>
#include <string_view>

namespace clerestory {

/// The 32 bytes of the digest.
std::string sha256(std::string_view bytes);

}  // namespace clerestory
