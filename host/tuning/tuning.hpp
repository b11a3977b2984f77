// What `clerestory tune` has measured of devices: CLBlast's parameters, and whose matrix products are faster. It is
// kept in one file of the user's; for some devices a set comes with the program (assets/tuning.json).
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/cl/device.hpp"

namespace clerestory {

/// Parameters of one of CLBlast's kernels: {"MWG": 64, ...}; and of several: {"Xgemm": {...}, ...}.
using ClblastValues = std::map<std::string, std::size_t>;
using ClblastParameters = std::map<std::string, ClblastValues>;

/// A matrix product or a pass of a convolution, timed in turns; the best seconds of each.
struct TuningFigure {
  std::string work;  // "product 64x19200x576": rows, columns, depth
  double flops = 0;
  double untuned = 0, tuned = 0;  // CLBlast by its own parameters, and by those that were found
  double packed = 0;              // our kernels
};

struct Tuning {
  std::string device;           // fingerprint
  std::string kind;             // tuning_kind
  std::string measured;         // when, UTC
  bool complete = false;        // the search had come to its end
  int sets = 0;                 // of parameters that were tried
  double noise = 0;             // relative: what CLBlast's own parameters differ by from themselves
  std::string clblast_version;  // that the parameters are for
  ClblastParameters clblast;    // empty: nothing was faster than CLBlast's own
  std::string tile;             // register tile of our kernels
  std::string gemm;             // the faster ones: "packed" or "clblast"
  std::string kernels;          // identity of the kernels that were compared with CLBlast
  std::vector<TuningFigure> figures;
};

/// Driver and target of its compiler, which shipped tunings go by: of PoCL, the CPU that it compiles for.
std::string tuning_kind(const DeviceInfo& info);
/// Identity of the kernels of convolutions and matrix products, as 16 hexadecimal digits.
std::string gemm_kernels();

/// Release of the CLBlast that is loaded: "1.5.3"; "unknown" where its file does not say.
std::string clblast_version();

/// $XDG_DATA_HOME/clerestory/tuning.json, else ~/.local/share/clerestory/tuning.json, else empty.
std::filesystem::path tuning_file();
/// The tunings of a file, none when there is no file. Throws usage_error naming file and fault.
std::vector<Tuning> read_tunings(const std::filesystem::path& file);
std::string tuning_json(const Tuning& tuning);
/// Puts a tuning into the user's file in the place of the same device's. Throws usage_error when that cannot be read or
/// written.
void keep_tuning(const Tuning& tuning);

struct TuningInUse {
  Tuning tuning;
  std::filesystem::path file;
  bool shipped = false;
};
/// The user's own, else a shipped one. Read anew at every call. A file that is damaged is named once and passed over.
std::optional<TuningInUse> tuning_in_use(const Device& device);

/// Whose matrix products `auto` takes, "packed" or "clblast": those that were measured faster on the device, by
/// this CLBlast where it won and by the kernels of this program where the user has measured; else our own.
std::string preferred_gemm(const Device& device);

}  // namespace clerestory
