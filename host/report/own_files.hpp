// Whose files lie in a folder of results. The program's are those that a provenance lists among its outputs, as long as
// they still have the content that was written; all others are somebody's, and nothing deletes them unasked.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/report/provenance.hpp"

namespace clerestory {

/// Every file in `folder`, by its name: for Provenance::outputs.
std::vector<FileRecord> record_files_in(const std::filesystem::path& folder);

/// Names in `folder` that its provenance.json does not account for, in order: files that it does not list or that were
/// changed since, and folders. provenance.json itself, report.html (`clerestory report` makes it again) and what killed
/// processes left are the program's. Throws ErrorKind::Usage when provenance.json cannot be read.
std::vector<std::string> foreign_in(const std::filesystem::path& folder);

/// Those of `files` that exist and that none of `records` lists, provenances in the same folder. A file that is itself
/// one of `records` is the program's when it lists another of `files`.
std::vector<std::string> foreign_among(const std::vector<std::filesystem::path>& files,
                                       const std::vector<std::filesystem::path>& records);

/// Says what is given up where `force`; else throws ErrorKind::Usage naming `where` and all of `foreign`, if any.
void give_up(const std::vector<std::string>& foreign, const std::filesystem::path& where, bool force);

}  // namespace clerestory
