#include "host/tuning/tuning.hpp"

#include <link.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <set>

#include "host/cl/disk_cache.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t largest_file = 16u << 20;

Json json_of(const Tuning& t) {
  Json figures = Json::array();
  for (const TuningFigure& f : t.figures)
    figures.push_back({{"work", f.work},
                       {"flops", f.flops},
                       {"seconds", {{"untuned", f.untuned}, {"tuned", f.tuned}, {"packed", f.packed}}}});
  return {{"device", t.device},
          {"kind", t.kind},
          {"measured", t.measured},
          {"complete", t.complete},
          {"sets", t.sets},
          {"noise", t.noise},
          {"clblast", {{"version", t.clblast_version}, {"parameters", t.clblast}}},
          {"tile", t.tile},
          {"gemm", {{"faster", t.gemm}, {"kernels", t.kernels}}},
          {"figures", figures}};
}

ClblastParameters parameters_of(const nlohmann::json& json) {
  ClblastParameters parameters;
  for (const auto& [kernel, values] : json.items())
    for (const auto& [name, value] : values.items())
      parameters[kernel][name] = whole_number<std::uint16_t>(value, kernel + "." + name, "clblast.parameters");
  return parameters;
}

Tuning tuning_of(const nlohmann::json& json) {
  Tuning t;
  json.at("device").get_to(t.device);
  json.at("kind").get_to(t.kind);
  json.at("measured").get_to(t.measured);
  json.at("complete").get_to(t.complete);
  t.sets = whole_number<int>(json.at("sets"), "sets", "tunings");
  json.at("noise").get_to(t.noise);
  json.at("clblast").at("version").get_to(t.clblast_version);
  t.clblast = parameters_of(json.at("clblast").at("parameters"));
  json.at("tile").get_to(t.tile);
  json.at("gemm").at("faster").get_to(t.gemm);
  json.at("gemm").at("kernels").get_to(t.kernels);
  if (t.gemm != "packed" && t.gemm != "clblast")
    throw usage_error("no such kernels", "gemm.faster", t.gemm, "packed or clblast");
  for (const nlohmann::json& figure : json.at("figures")) {
    const nlohmann::json& seconds = figure.at("seconds");
    t.figures.push_back({figure.at("work").get<std::string>(), figure.at("flops").get<double>(),
                         seconds.at("untuned").get<double>(), seconds.at("tuned").get<double>(),
                         seconds.at("packed").get<double>()});
  }
  return t;
}

/// The shipped file, where it is found.
fs::path shipped_file() {
  for (const fs::path& place : data_places("assets/tuning.json"))
    if (std::error_code unreadable; fs::exists(place, unreadable)) return place;
  return {};
}

/// Nothing of a file that cannot be read: it is said once.
std::vector<Tuning> readable_tunings(const fs::path& file) {
  static std::set<std::string> said;
  static std::mutex guard;
  try {
    return read_tunings(file);
  } catch (const Error& error) {
    const std::lock_guard lock(guard);
    if (said.insert(error.what()).second) say(fmt::format("passed over, as if it were not there: {}", error.what()));
    return {};
  }
}

}  // namespace

std::string tuning_kind(const DeviceInfo& info) {
  return fmt::format("{} | {} | {}", info.platform, info.driver, info.version);
}

std::string gemm_kernels() {
  std::string sources;
  for (const char* file :
       {"nn/conv_cpu.cl", "nn/conv_winograd.cl", "nn/conv_gpu.cl", "nn/conv_pack.cl", "nn/im2col.cl"})
    sources += kernel_hash(file);
  return fmt::format("{:016x}", hash_text(sources));
}

std::string clblast_version() {
  std::string version = "unknown";
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t, void* to) {
        constexpr std::string_view stem = "libclblast.so";
        std::error_code error;
        if (!std::filesystem::path(library->dlpi_name).filename().string().starts_with(stem)) return 0;
        const std::string file = std::filesystem::canonical(library->dlpi_name, error).filename().string();
        if (file.size() > stem.size() + 1) *static_cast<std::string*>(to) = file.substr(stem.size() + 1);
        return 1;
      },
      &version);
  return version;
}

fs::path tuning_file() {
  // The base directory specification asks to ignore a relative path.
  if (const char* data = std::getenv("XDG_DATA_HOME"); data != nullptr && *data == '/')
    return fs::path(data) / "clerestory/tuning.json";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return fs::path(home) / ".local/share/clerestory/tuning.json";
  return {};
}

std::vector<Tuning> read_tunings(const fs::path& file) {
  std::error_code unreadable;  // a home that this user may not enter
  if (file.empty() || !fs::exists(file, unreadable)) {
    if (unreadable) throw usage_error(unreadable.message(), file.string());
    return {};
  }
  const nlohmann::json json = parse_json_object(read_file(file, largest_file), file.string());
  std::vector<Tuning> tunings;
  try {
    for (const nlohmann::json& entry : json.at("tunings")) tunings.push_back(tuning_of(entry));
  } catch (const nlohmann::json::exception& error) {
    throw usage_error(std::string("not a file of `clerestory tune`: ") + error.what(), file.string());
  } catch (const Error& error) {
    throw usage_error(error.what(), file.string());
  }
  return tunings;
}

std::string tuning_json(const Tuning& tuning) {
  // Drivers may name themselves in any encoding.
  return json_text(json_of(tuning));
}

void keep_tuning(const Tuning& tuning) {
  const fs::path file = tuning_file();
  if (file.empty()) throw usage_error("no place for what was measured", "HOME", "", "a folder, or XDG_DATA_HOME");
  std::vector<Tuning> tunings = read_tunings(file);
  std::erase_if(tunings, [&](const Tuning& other) { return other.device == tuning.device; });
  tunings.push_back(tuning);
  Json list = Json::array();
  for (const Tuning& each : tunings) list.push_back(json_of(each));
  make_directories(file.parent_path());
  write_file(file, json_text(Json{{"tunings", list}}) + "\n");
}

std::optional<TuningInUse> tuning_in_use(const Device& device) {
  const fs::path own = tuning_file(), shipped = shipped_file();
  const std::string fingerprint = device.fingerprint(), kind = tuning_kind(device.info());
  for (const Tuning& tuning : readable_tunings(own))
    if (tuning.device == fingerprint) return TuningInUse{tuning, own, false};
  for (const Tuning& tuning : readable_tunings(shipped))
    if (tuning.kind == kind) return TuningInUse{tuning, shipped, true};
  return {};
}

std::string preferred_gemm(const Device& device) {
  // Untuned, CLBlast's gradient of weights takes most of a training step on a GPU.
  const auto used = tuning_in_use(device);
  if (!used || (!used->shipped && used->tuning.kernels != gemm_kernels())) return "packed";
  const bool other_clblast = used->tuning.clblast_version != clblast_version();  // its parameters are not used
  return used->tuning.gemm == "clblast" && other_clblast ? "packed" : used->tuning.gemm;
}

}  // namespace clerestory
