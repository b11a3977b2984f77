// Where a result came from: provenance.json of every run.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "host/report/table.hpp"

namespace clerestory {

/// By this file a folder of results is known.
inline constexpr const char* kProvenanceName = "provenance.json";

/// What this program was built from.
struct Build {
  std::string commit;  // git describe, "unknown" outside git
  bool dirty = false;  // tracked files differed from the commit
  std::string type, compiler, version;
};
const Build& this_build();

/// Something that was not computed because this input did not need it.
struct LeftOut {
  std::string what, why, saved;  // "global light", "no pixel misses the scene", "1.2 s, 40 MB"
};

struct FileRecord {
  std::string path, hash;  // as given on the command line, or written: in the provenance's own folder its name alone;
                           // file_hash of host/io/files.hpp
  std::uintmax_t bytes = 0;
};

/// Generated rooms that figures were measured on.
struct RoomsRecord {
  std::string setting;               // training | held_out
  std::vector<std::uint64_t> seeds;  // one a room
};

struct Provenance {
  std::vector<std::string> command;  // argv
  Build build;
  std::string host, cpu;
  std::string device;                              // Device::fingerprint()
  std::map<std::string, std::string> environment;  // what drivers, CLBlast and this program go by
  std::map<std::string, std::string> hashes;       // of what is no file: "config", "kernels"
  RoomsRecord rooms;
  std::map<std::string, std::uint64_t> seeds;
  std::map<std::string, std::string> facts;  // solvers, chosen options, scale of depth, NaN drop rate...
  std::map<std::string, double> figures;     // seconds of each stage, peak memory
  std::vector<FileRecord> inputs, outputs;
  std::vector<LeftOut> left_out;
  std::string started, ended;  // UTC, "2026-01-31T12:00:00Z"; ended empty while running
};

/// Filled with what is known at the start: build, host, CPU, environment, start time, `command`.
Provenance begin_provenance(std::vector<std::string> command, std::string device = {});

/// Size and hash of a file. Throws ErrorKind::Usage when it cannot be read.
FileRecord record_file(const std::filesystem::path& path);

std::string utc_now();
std::string provenance_json(const Provenance& provenance);
/// Writes provenance.json under a temporary name and renames it.
void write_provenance(const std::filesystem::path& path, const Provenance& provenance);
Provenance read_provenance(const std::filesystem::path& path);

/// The command line as one would type it again, quoted where the shell needs it.
std::string command_text(const std::vector<std::string>& command);

}  // namespace clerestory
