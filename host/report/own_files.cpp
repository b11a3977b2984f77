#include "host/report/own_files.hpp"

#include <algorithm>
#include <set>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace fs = std::filesystem;
namespace {

/// A lock (FolderLock) holds a name at most, a temporary (AtomicFile) has two numbers before its ending,
/// `.NAME.partial` (StagedFolder) is a folder.
bool left_by_a_killed_process(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const auto status = entry.symlink_status();
  if (!name.starts_with(".")) return false;
  if (fs::is_directory(status)) return name.ends_with(".partial");
  if (!fs::is_regular_file(status)) return false;
  if (name.ends_with(".lock")) return is_left_lock(entry.path());
  const std::string numbers = fs::path(entry.path().stem()).extension().string();
  return name.ends_with(".tmp") && numbers.size() > 1 &&
         numbers.find_first_not_of("0123456789-", 1) == std::string::npos;
}

const FileRecord* find_output(const Provenance& provenance, const std::string& name) {
  const auto found = std::ranges::find(provenance.outputs, name, &FileRecord::path);
  return found == provenance.outputs.end() ? nullptr : &*found;
}

bool is_unchanged(const fs::path& file, const FileRecord& written) {
  return fs::is_regular_file(fs::symlink_status(file)) && fs::file_size(file) == written.bytes &&
         file_hash(file) == written.hash;
}

}  // namespace

std::vector<FileRecord> record_files_in(const fs::path& folder) {
  std::vector<FileRecord> records;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    records.push_back(record_file(entry.path()));
    records.back().path = entry.path().filename().string();
  }
  std::ranges::sort(records, {}, &FileRecord::path);
  return records;
}

std::vector<std::string> foreign_in(const fs::path& folder) {
  const Provenance provenance = read_provenance(folder / kProvenanceName);
  std::vector<std::string> foreign;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name == kProvenanceName || name == "report.html" || left_by_a_killed_process(entry)) continue;
    const FileRecord* written = find_output(provenance, name);
    if (written && is_unchanged(entry.path(), *written)) continue;
    const bool is_folder = fs::is_directory(entry.symlink_status());
    foreign.push_back(name + (is_folder ? "/" : written ? " (changed since)" : ""));
  }
  std::ranges::sort(foreign);
  return foreign;
}

std::vector<std::string> foreign_among(const std::vector<fs::path>& files, const std::vector<fs::path>& records) {
  std::set<fs::path> own;
  for (const fs::path& record : records) {
    if (!fs::exists(record)) continue;
    try {
      const Provenance provenance = read_provenance(record);
      for (const fs::path& file : files)
        if (const FileRecord* written = find_output(provenance, file.filename().string())) {
          own.insert(record);
          if (fs::exists(file) && is_unchanged(file, *written)) own.insert(file);
        }
    } catch (const Error&) {  // somebody else's file of that name
    }
  }
  std::vector<std::string> foreign;
  for (const fs::path& file : files)
    if (fs::exists(fs::symlink_status(file)) && !own.contains(file)) foreign.push_back(file.filename().string());
  return foreign;
}

void give_up(const std::vector<std::string>& foreign, const fs::path& where, bool force) {
  if (foreign.empty()) return;
  constexpr std::size_t kMostNames = 50;
  std::string names;
  for (std::size_t i = 0; i < std::min(foreign.size(), kMostNames); ++i) names += (i ? ", " : "") + foreign[i];
  if (foreign.size() > kMostNames) names += fmt::format(" and {} more", foreign.size() - kMostNames);
  if (!force)
    throw usage_error("what this run did not write, or what was made from it, would be lost", where.string(), names,
                      "another --out, or --force to give it up");
  say(fmt::format("{}: given up (--force): {}", where.string(), names));
}

}  // namespace clerestory
