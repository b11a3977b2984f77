// All results of a source tree: which there are, which are missing or stale, and where a text says other than they do.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// A result that experiments/reproduce/NAME.sh makes. The script's first comment is its title; after it stands
/// "# minutes: N", the minutes that it takes on two cores.
struct CatalogueEntry {
  std::string name, title;
  double minutes = 0;               // as the script says; a result's own depend on what else the machine did
  bool missing = false;             // no docs/results/NAME.json
  std::vector<std::string> staled;  // what the figures were made with and is no longer so: kernels, config, files

  bool current() const { return !missing && staled.empty(); }
};

/// Missing and stale ones first, then by name. Scripts without minutes make no result. Throws ErrorKind::Usage for a
/// script or a JSON that cannot be read.
std::vector<CatalogueEntry> catalogue(const std::filesystem::path& tree);

/// Compares every docs/results/NAME.json with its .md and .svg, and with the blocks of all documents (blocks.hpp). What
/// differs, or speaks of a result that does not exist, each with its place: "README.md:12: ...".
std::vector<std::string> differences_in(const std::filesystem::path& tree);

/// Makes the blocks of result `name`, of all results if empty, in all documents anew. Returns the files changed. Throws
/// ErrorKind::Usage for a block of such a result or table that does not exist.
std::vector<std::filesystem::path> refresh_blocks(const std::filesystem::path& tree, const std::string& name = {});

}  // namespace clerestory
