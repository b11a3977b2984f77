#include "experiments/bench/clblast_search.hpp"

#include <algorithm>
#include <array>

namespace clerestory {
namespace {

constexpr double most_lost = 0.95;
constexpr std::size_t most_group = 1024;  // work-items
// Accumulators of a work-item: in vectors that stay in registers, or of kernels with barriers, whose unrolled loops
// keep compilers busy for minutes where there are more.
constexpr std::size_t most_sums = 1024, most_sums_beside_barriers = 64;

const ClblastTrial* best_trial(const std::vector<ClblastTrial>& trials) {
  const ClblastTrial* best = nullptr;
  for (const ClblastTrial& trial : trials)
    if (trial.fault.empty() && trial.least >= most_lost && (best == nullptr || trial.gain > best->gain)) best = &trial;
  return best;
}

bool multiple(std::size_t of, std::size_t by) { return by > 0 && of % by == 0; }

bool vector_width(std::size_t v) { return v == 1 || v == 2 || v == 4 || v == 8 || v == 16; }

bool valid_xgemm(const ClblastValues& v) {
  const auto at = [&](const char* name) { return v.at(name); };
  const bool shared = at("GEMMK") == 0;
  if (!vector_width(at("VWM")) || !vector_width(at("VWN")) || !multiple(at("KWG"), at("KWI"))) return false;
  for (const char* threads : {"MDIMC", "MDIMA"})
    if (!multiple(at("MWG"), at(threads) * at("VWM"))) return false;
  for (const char* threads : {"NDIMC", "NDIMB"})
    if (!multiple(at("NWG"), at(threads) * at("VWN"))) return false;
  const std::size_t group = at("MDIMC") * at("NDIMC"), sums = at("MWG") * at("NWG") / group;
  if (group > most_group || sums > (shared ? most_sums_beside_barriers : most_sums)) return false;
  if (shared)
    return at("KREG") == 1 && multiple(group, at("MDIMA")) && multiple(group, at("NDIMB")) &&
           multiple(at("KWG"), group / at("MDIMA")) && multiple(at("KWG"), group / at("NDIMB"));
  return at("MWG") == at("NWG") && multiple(at("KREG"), at("VWN")) && at("MDIMA") == at("MDIMC") &&
         at("NDIMB") == at("NDIMC") && at("SA") + at("SB") + at("STRM") + at("STRN") == 0 && at("KWG") == 1;
}

bool valid_direct(const ClblastValues& v) {
  const auto at = [&](const char* name) { return v.at(name); };
  if (!vector_width(at("VWMD")) || !vector_width(at("VWND")) || !multiple(at("WGD"), at("KWID"))) return false;
  for (const char* threads : {"MDIMCD", "MDIMAD"})
    if (!multiple(at("WGD"), at(threads) * at("VWMD"))) return false;
  for (const char* threads : {"NDIMCD", "NDIMBD"})
    if (!multiple(at("WGD"), at(threads) * at("VWND"))) return false;
  const std::size_t group = at("MDIMCD") * at("NDIMCD"), sums = at("WGD") * at("WGD") / group;
  return group <= most_group && sums <= most_sums_beside_barriers && multiple(group, at("MDIMAD")) &&
         multiple(group, at("NDIMBD")) && multiple(at("WGD"), group / at("MDIMAD")) &&
         multiple(at("WGD"), group / at("NDIMBD"));
}

ClblastValues xgemm(std::size_t kernel, std::size_t kreg, std::size_t kwg, std::size_t kwi,
                    std::array<std::size_t, 2> tile, std::array<std::size_t, 2> threads, std::size_t shared,
                    std::size_t vwm, std::size_t vwn) {
  return {{"GEMMK", kernel},     {"KREG", kreg},        {"KWG", kwg},          {"KWI", kwi},
          {"MWG", tile[0]},      {"NWG", tile[1]},      {"MDIMC", threads[0]}, {"NDIMC", threads[1]},
          {"MDIMA", threads[0]}, {"NDIMB", threads[1]}, {"SA", shared},        {"SB", shared},
          {"STRM", 0},           {"STRN", 0},           {"VWM", vwm},          {"VWN", vwn}};
}

ClblastValues direct(std::size_t wgd, std::array<std::size_t, 2> threads, std::size_t kwid, std::size_t vwmd,
                     std::size_t vwnd, std::size_t pad) {
  return {{"WGD", wgd},           {"MDIMCD", threads[0]}, {"NDIMCD", threads[1]}, {"MDIMAD", threads[0]},
          {"NDIMBD", threads[1]}, {"KWID", kwid},         {"VWMD", vwmd},         {"VWND", vwnd},
          {"PADA", pad},          {"PADB", pad}};
}

ClblastValues copies(std::array<std::size_t, 4> copy, std::array<std::size_t, 4> pad, std::array<std::size_t, 4> tra,
                     std::array<std::size_t, 3> padtra) {
  return {{"COPY_DIMX", copy[0]},     {"COPY_DIMY", copy[1]},    {"COPY_VW", copy[2]},     {"COPY_WPT", copy[3]},
          {"PAD_DIMX", pad[0]},       {"PAD_DIMY", pad[1]},      {"PAD_WPTX", pad[2]},     {"PAD_WPTY", pad[3]},
          {"TRA_DIM", tra[0]},        {"TRA_PAD", tra[1]},       {"TRA_SHUFFLE", tra[2]},  {"TRA_WPT", tra[3]},
          {"PADTRA_TILE", padtra[0]}, {"PADTRA_WPT", padtra[1]}, {"PADTRA_PAD", padtra[2]}};
}

/// Sets of the processors in CLBlast's public data base (its releases up to 1.7), and register tiles such as our own.
std::vector<ClblastValues> known_sets(const std::string& kernel) {
  if (kernel == "Xgemm")
    return {xgemm(1, 16, 1, 1, {64, 64}, {2, 2}, 0, 8, 2), xgemm(1, 4, 1, 1, {32, 32}, {2, 4}, 0, 16, 1),
            xgemm(1, 4, 1, 1, {64, 64}, {2, 8}, 0, 16, 2), xgemm(1, 2, 1, 1, {16, 16}, {1, 1}, 0, 16, 1),
            xgemm(1, 4, 1, 1, {32, 32}, {4, 4}, 0, 8, 1),  xgemm(1, 4, 1, 1, {64, 64}, {4, 4}, 0, 4, 4),
            xgemm(1, 2, 1, 1, {64, 64}, {16, 4}, 0, 1, 1), xgemm(0, 1, 32, 2, {64, 64}, {8, 8}, 1, 4, 2),
            xgemm(0, 1, 32, 2, {32, 32}, {8, 8}, 0, 4, 4), xgemm(0, 1, 32, 8, {32, 32}, {2, 8}, 0, 16, 1)};
  if (kernel == "XgemmDirect")
    return {direct(64, {8, 8}, 8, 8, 4, 0),   direct(32, {8, 8}, 8, 4, 4, 0), direct(64, {8, 8}, 16, 2, 4, 0),
            direct(32, {16, 8}, 16, 1, 1, 0), direct(32, {4, 4}, 8, 8, 4, 0), direct(64, {16, 16}, 8, 1, 1, 0)};
  return {copies({8, 8, 8, 4}, {8, 8, 4, 4}, {8, 0, 0, 8}, {16, 4, 0}),
          copies({32, 8, 4, 4}, {32, 16, 4, 2}, {4, 0, 0, 8}, {16, 4, 0}),
          copies({8, 32, 8, 8}, {16, 32, 4, 4}, {8, 1, 0, 8}, {8, 8, 0}),
          copies({32, 16, 8, 1}, {32, 32, 4, 4}, {4, 0, 0, 16}, {32, 1, 0})};
}

/// Names that change together; what the kernel reads follows what it computes.
using Tied = std::vector<const char*>;

std::vector<Tied> axes(const std::string& kernel, const ClblastValues& at) {
  if (kernel == "XgemmDirect")
    return {{"VWMD"}, {"MDIMCD", "MDIMAD"}, {"NDIMCD", "NDIMBD"}, {"WGD"}, {"VWND"}, {"KWID"}};
  if (kernel != "Xgemm") return {};
  if (at.at("GEMMK") == 0)
    return {{"VWM"}, {"MDIMC", "MDIMA"}, {"NDIMC", "NDIMB"}, {"MWG"}, {"NWG"}, {"VWN"}, {"KWI"}, {"KWG"}};
  return {{"MDIMC", "MDIMA"},
          {"NDIMC", "NDIMB"},
          {"VWM"},
          {"KREG"},
          {"MWG", "NWG"},
          {"VWN"},
          {"MWG", "NWG", "MDIMC", "MDIMA"},
          {"MWG", "NWG", "NDIMC", "NDIMB"}};
}

std::vector<Tied> switches(const std::string& kernel, const ClblastValues& at) {
  if (kernel == "XgemmDirect") return {{"PADA", "PADB"}};
  if (kernel == "Xgemm" && at.at("GEMMK") == 0) return {{"SA", "SB"}, {"STRM"}, {"STRN"}};
  return {};
}

/// Twice and half of each, and the other way of each switch.
std::vector<ClblastValues> neighbours(const std::string& kernel, const ClblastValues& at) {
  std::vector<ClblastValues> found;
  const auto add = [&](const Tied& names, const auto& change) {
    ClblastValues values = at;
    for (const char* name : names) values[name] = change(values.at(name));
    if (valid_values(kernel, values)) found.push_back(values);
  };
  for (const Tied& names : axes(kernel, at)) {
    add(names, [](std::size_t v) { return 2 * v; });
    add(names, [](std::size_t v) { return v / 2; });
  }
  for (const Tied& names : switches(kernel, at)) add(names, [](std::size_t v) { return 1 - v; });
  return found;
}

}  // namespace

bool valid_values(const std::string& kernel, const ClblastValues& values) {
  if (kernel == "Copies") return true;
  for (const auto& [name, value] : values) {
    const bool may_be_zero = name == "GEMMK" || name.starts_with("S") || name.starts_with("PAD");
    if (value == 0 && !may_be_zero) return false;
  }
  return kernel == "Xgemm" ? valid_xgemm(values) : valid_direct(values);
}

std::optional<ClblastValues> ClblastSearch::next() const {
  const auto untried = [&](const ClblastValues& values) {
    return std::ranges::none_of(trials, [&](const ClblastTrial& trial) { return trial.values == values; });
  };
  if (untried(own)) return own;
  for (const ClblastValues& values : known_sets(kernel))
    if (untried(values)) return values;
  for (const ClblastValues& values : neighbours(kernel, best()))
    if (untried(values)) return values;
  return {};
}

ClblastValues ClblastSearch::best() const {
  const ClblastTrial* best = best_trial(trials);
  return best ? best->values : own;
}

double ClblastSearch::best_gain() const {
  const ClblastTrial* best = best_trial(trials);
  return best ? best->gain : 1;
}

}  // namespace clerestory
