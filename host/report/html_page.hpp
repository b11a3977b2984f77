// The look and the behaviour of a report: put into every page as they are.
#pragma once

namespace clerestory {

extern const char* const kPageStyle;   // CSS
extern const char* const kPageScript;  // JavaScript; the page is readable without it

}  // namespace clerestory
