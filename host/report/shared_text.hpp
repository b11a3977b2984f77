// Text of a page that may be handed on: it names files, not the folders of the computer that made it.
#pragma once
#include <string>

#include "host/report/provenance.hpp"

namespace clerestory {

/// `text` with the last name in the place of every absolute path. Those of `record` (words of its command, inputs) are
/// known whole; one that begins a quoted text ends with the quote, others at a space, a comma, a quote or a bracket.
std::string without_folders(std::string text, const Provenance& record);
/// The same of its note and of the words in its cells.
Table without_folders(Table table, const Provenance& record);

/// command_text() with the last name in the place of every absolute path, the program's too.
std::string shared_command(const Provenance& record);

}  // namespace clerestory
