#pragma once

namespace clerestory {

class CommandLine;
/// `clerestory report RUN`: makes report.html again from the files of a run.
void add_report_command(CommandLine& line);

}  // namespace clerestory
