// Collecting, writing and reading provenance.json.
#include "host/report/provenance.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>

#include "host/environment.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nesting.hpp"

namespace clerestory {
namespace {

#include "host/report/build_info.inc"

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 20;  // of a file

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string host_name() {
  char name[256] = {};
  return ::gethostname(name, sizeof(name) - 1) == 0 ? name : "unknown";
}

/// The variables that change what is computed or how fast.
std::map<std::string, std::string> relevant_environment() {
  return environment_with({"POCL_", "CLBLAST_", "CLERESTORY_", "OCL_", "CL_CONFIG_", "RUSTICL_", "OCLGRIND_"});
}

Json files_json(const std::vector<FileRecord>& files) {
  Json list = Json::array();
  for (const FileRecord& file : files)
    list.push_back({{"path", file.path}, {"bytes", file.bytes}, {"hash", file.hash}});
  return list;
}

std::vector<FileRecord> files_of(const Json& list, const std::string& where) {
  std::vector<FileRecord> files;
  for (const Json& file : list)
    files.push_back({file.at("path").get<std::string>(), file.at("hash").get<std::string>(),
                     whole_number<std::uintmax_t>(file.at("bytes"), "bytes", where)});
  return files;
}

bool plain_for_shell(const std::string& word) {
  return !word.empty() && std::ranges::all_of(word, [](unsigned char c) {
    return std::isalnum(c) || std::string_view("-_./=:,+@%").find(static_cast<char>(c)) != std::string_view::npos;
  });
}

}  // namespace

const Build& this_build() {
  static const Build build{kCommit, kDirty, kBuildType, kCompiler, kVersion};
  return build;
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

Provenance begin_provenance(std::vector<std::string> command, std::string device) {
  Provenance p;
  p.command = std::move(command);
  p.build = this_build();
  p.host = host_name();
  p.cpu = cpu_name();
  p.device = std::move(device);
  p.environment = relevant_environment();
  p.started = utc_now();
  return p;
}

FileRecord record_file(const std::filesystem::path& path) {
  const std::string hash = file_hash(path);
  return {path.string(), hash, std::filesystem::file_size(path)};
}

std::string command_text(const std::vector<std::string>& command) {
  std::string text;
  for (const std::string& word : command) {
    if (!text.empty()) text += " ";
    if (plain_for_shell(word)) {
      text += word;
      continue;
    }
    text += "'";
    for (char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    text += "'";
  }
  return text;
}

std::string provenance_json(const Provenance& p) {
  Json left_out = Json::array();
  for (const LeftOut& item : p.left_out)
    left_out.push_back({{"what", item.what}, {"why", item.why}, {"saved", item.saved}});
  const Json json = {{"command", p.command},
                     {"build",
                      {{"commit", p.build.commit},
                       {"dirty", p.build.dirty},
                       {"type", p.build.type},
                       {"compiler", p.build.compiler},
                       {"version", p.build.version}}},
                     {"host", p.host},
                     {"cpu", p.cpu},
                     {"device", p.device},
                     {"environment", p.environment},
                     {"hashes", p.hashes},
                     {"rooms", {{"setting", p.rooms.setting}, {"seeds", p.rooms.seeds}}},
                     {"seeds", p.seeds},
                     {"facts", p.facts},
                     {"figures", p.figures},
                     {"inputs", files_json(p.inputs)},
                     {"outputs", files_json(p.outputs)},
                     {"left_out", left_out},
                     {"started", p.started},
                     {"ended", p.ended}};
  // Paths and the environment need not be UTF-8: what is not becomes U+FFFD instead of an error.
  return json_text(json) + "\n";
}

void write_provenance(const std::filesystem::path& path, const Provenance& provenance) {
  write_file(path, provenance_json(provenance));
}

Provenance read_provenance(const std::filesystem::path& path) {
  const std::string where = path.string(), text = read_file(path, kMostBytes);
  check_nesting(text, where);
  try {
    const Json json = Json::parse(text);
    Provenance p;
    json.at("command").get_to(p.command);
    const Json& build = json.at("build");
    p.build = {build.at("commit").get<std::string>(), build.at("dirty").get<bool>(),
               build.at("type").get<std::string>(), build.at("compiler").get<std::string>(),
               build.at("version").get<std::string>()};
    json.at("host").get_to(p.host);
    json.at("cpu").get_to(p.cpu);
    json.at("device").get_to(p.device);
    json.at("environment").get_to(p.environment);
    if (json.contains("hashes")) json.at("hashes").get_to(p.hashes);  // runs of earlier versions lack these two
    if (json.contains("rooms")) {
      json.at("rooms").at("setting").get_to(p.rooms.setting);
      for (const Json& seed : json.at("rooms").at("seeds"))
        p.rooms.seeds.push_back(whole_number<std::uint64_t>(seed, "seeds", where));
    }
    for (const auto& [name, seed] : json.at("seeds").items())
      p.seeds[name] = whole_number<std::uint64_t>(seed, name, where);
    json.at("facts").get_to(p.facts);
    json.at("figures").get_to(p.figures);
    p.inputs = files_of(json.at("inputs"), where);
    p.outputs = files_of(json.at("outputs"), where);
    for (const Json& item : json.at("left_out"))
      p.left_out.push_back(
          {item.at("what").get<std::string>(), item.at("why").get<std::string>(), item.at("saved").get<std::string>()});
    json.at("started").get_to(p.started);
    json.at("ended").get_to(p.ended);
    return p;
  } catch (const Json::exception& error) {
    throw usage_error(std::string("not a provenance file: ") + error.what(), where);
  }
}

}  // namespace clerestory
