#include "host/report/terminal.hpp"

#include <fmt/format.h>

#include <cstdint>

namespace clerestory {
namespace {

struct Character {
  std::uint32_t code;
  std::size_t bytes;  // 0: no UTF-8
};

/// The character at the front (RFC 3629, section 3): no overlong forms, no surrogates, nothing beyond U+10FFFF.
Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t bytes = byte(0) < 0x80            ? 1
                            : byte(0) >> 5 == 0b110   ? 2
                            : byte(0) >> 4 == 0b1110  ? 3
                            : byte(0) >> 3 == 0b11110 ? 4
                                                      : 0;
  if (bytes <= 1) return {byte(0), bytes};
  if (text.size() < bytes) return {0, 0};
  std::uint32_t code = byte(0) & 0x7fu >> bytes;
  for (std::size_t i = 1; i < bytes; ++i) {
    if (byte(i) >> 6 != 0b10) return {0, 0};
    code = code << 6 | (byte(i) & 0x3fu);
  }
  constexpr std::uint32_t least[] = {0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return code < least[bytes - 2] || surrogate || code > 0x10ffff ? Character{0, 0} : Character{code, bytes};
}

bool harmless(std::uint32_t code) {
  if (code == '\n' || code == '\t') return true;
  const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  const bool turns =
      code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
  return !control && !turns;
}

}  // namespace

std::string terminal_text(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto [code, bytes] = first_of(text);
    if (bytes == 0)
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
    else if (harmless(code))
      out += text.substr(0, bytes);
    else
      out += code < 0x100 ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
    text.remove_prefix(bytes == 0 ? 1 : bytes);
  }
  return out;
}

}  // namespace clerestory
