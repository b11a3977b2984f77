// Text from files and names as it may stand on a terminal.
#pragma once
#include <string>
#include <string_view>

namespace clerestory {

/// Control characters other than newline and tab (they move the cursor, colour and rename the window), bytes that are
/// no UTF-8, and the marks that turn the direction of writing are written as \x1b and \u202e; everything else stays.
std::string terminal_text(std::string_view text);

}  // namespace clerestory
