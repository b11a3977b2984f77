#include "checks/op_check.hpp"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cstdlib>
#include <random>

#include "checks/op_run.hpp"
#include "host/cl/tile.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr int kGroup = 16;  // work-items to a row

double epsilon(Precision p) { return p == Precision::Single ? FLT_EPSILON : DBL_EPSILON; }
double largest(const Tensor& t) {
  double m = 0;
  for (const double x : t.real) m = std::max(m, std::abs(x));
  return m;
}

OpCase rounded_to_float(OpCase c) {
  for (auto& [name, tensor] : c.inputs) tensor = rounded_to_float(std::move(tensor));
  for (auto& [name, tensor] : c.states) tensor = rounded_to_float(std::move(tensor));
  return c;
}

std::vector<Precision> precisions_of(const CheckedDevices& devices) {
  if (!devices.with_doubles) return {Precision::Single};
  return {Precision::Single, Precision::Double};
}

double weighted_sum(const std::vector<Tensor>& outputs, const std::vector<Tensor>& cotangents) {
  long double sum = 0;
  for (std::size_t o = 0; o < cotangents.size(); ++o)
    for (std::size_t i = 0; i < cotangents[o].real.size(); ++i)
      sum += static_cast<long double>(outputs[o].real[i]) * cotangents[o].real[i];
  return static_cast<double>(sum);
}

/// Outputs {which, element} that differ between two runs, or are NaN.
using Places = std::set<std::pair<std::size_t, std::size_t>>;
template <class Is>
Places places(const std::vector<Tensor>& outputs, Is is) {
  Places found;
  for (std::size_t o = 0; o < outputs.size(); ++o)
    for (std::size_t i = 0; i < outputs[o].real.size(); ++i)
      if (is(o, i)) found.emplace(o, i);
  return found;
}

bool lies_in(const std::string& room, const std::string& stem) {
  return std::ranges::count(kernel_files(), room + "/" + stem + ".cl") > 0;
}

std::set<std::string> names_of(const std::set<KernelVariant>& variants) {
  std::set<std::string> names;
  for (const KernelVariant& v : variants) names.insert(v.name);
  return names;
}

/// While it lives, kernels are built in the tile.
class InTile {
 public:
  InTile(const Device& device, const std::string& tile) : device_(device) { device_.use_tile(tile); }
  ~InTile() { device_.use_tile("auto"); }
  InTile(const InTile&) = delete;
  InTile& operator=(const InTile&) = delete;

 private:
  Device device_;
};

/// While it lives, plans multiply by CLBlast.
class InClblast {
 public:
  explicit InClblast(const CheckedDevices& devices) : devices_{devices.single} {
    if (devices.with_doubles) devices_.push_back(*devices.with_doubles);
    use("clblast");
  }
  ~InClblast() { use("auto"); }
  InClblast(const InClblast&) = delete;
  InClblast& operator=(const InClblast&) = delete;

 private:
  void use(const std::string& gemm) {
    for (Device& device : devices_) device.use_gemm(gemm);
  }
  std::vector<Device> devices_;
};

/// While it lives, so many work-items share a row (host/ops/tensor/rows.hpp).
class InGroups {
 public:
  explicit InGroups(int group) {
    if (const char* set = std::getenv(kVariable)) before_ = set;
    setenv(kVariable, std::to_string(group).c_str(), 1);
  }
  ~InGroups() {
    if (before_)
      setenv(kVariable, before_->c_str(), 1);
    else
      unsetenv(kVariable);
  }
  InGroups(const InGroups&) = delete;
  InGroups& operator=(const InGroups&) = delete;

 private:
  static constexpr const char* kVariable = "CLERESTORY_GROUP";
  std::optional<std::string> before_;
};

/// The checks of one case; what they find goes into `findings`.
class Check {
 public:
  Check(const OpCase& c, const CheckedDevices& devices, OpFindings& findings)
      : case_(c), devices_(devices), findings_(findings), name_(c.name()) {}

  void everything() {
    const std::vector<Tensor> want = case_.reference(all_tensors(case_));
    for (const Precision precision : precisions_of(devices_)) {
      run_in(precision);
      if (!against_reference(precision, want)) return;
    }
    if (devices_.with_doubles) float_against_double();
    if (lies_in("nn", case_.stem) || lies_in("tensor", case_.stem)) nan_is_not_hidden();
    if (devices_.with_doubles && differentiates()) differences();
  }

  /// Kernels of the case that what was found may come from.
  std::set<std::string> suspects() {
    const std::set<std::string> own(case_.kernels.begin(), case_.kernels.end());
    if (!differentiates() || slope_faults_ + value_faults_ < findings_.faults.size()) return own;
    forget_launched();
    run(Precision::Single)();
    const std::set<std::string> forward = names_of(launched_variants(Precision::Single));
    std::set<std::string> some;
    for (const std::string& kernel : own)
      if (forward.contains(kernel) == (value_faults_ > 0)) some.insert(kernel);
    return some.empty() ? own : some;
  }

  void tiles_agree() {
    for (const Precision precision : precisions_of(devices_)) {
      const auto run_in_tile = [&](const std::string& name) {
        const InTile tile(device_of(devices_, precision), name);
        OpRun usual = run(precision, {.with_gradients = differentiates()});
        outputs_ = usual.outputs().size() - case_.differentiate.size();
        return std::array{usual(), run(precision, {.wrap = true, .with_gradients = differentiates()})()};
      };
      const auto own = run_in_tile("auto");
      for (const Tile& tile : tiles()) {
        const std::string what = fmt::format("{} in {}, tile {}", name_, text(precision), tile.name);
        const auto in_tile = run_in_tile(tile.name);
        same_bits(in_tile[0], own[0], what), same_bits(in_tile[1], own[1], what + ", as slices of bigger tensors");
      }
    }
  }

 private:
  bool differentiates() const { return !case_.differentiate.empty(); }
  bool is_gradient(std::size_t i) const { return i >= outputs_ && i < outputs_ + case_.differentiate.size(); }

  template <class... Args>
  void fault(fmt::format_string<Args...> format, Args&&... args) {
    ++(of_slopes_ ? slope_faults_ : value_faults_);
    findings_.faults.push_back(fmt::format(format, std::forward<Args>(args)...));
  }

  OpRun run(Precision precision, OpRun::How how = {}) {
    return OpRun(case_, devices_, precision, findings_, std::move(how));
  }

  /// Runs it twice, without passes and in slices: equal bits, and the kernels are launched.
  void run_in(Precision precision) {
    std::vector<Tensor>& results = results_[precision];
    OpRun usual = run(precision, {.with_gradients = differentiates()});
    outputs_ = usual.outputs().size() - case_.differentiate.size(), cotangents_ = usual.cotangents();
    results = usual();
    same_bits(usual(), results, fmt::format("{} in {}, second run", name_, text(precision)));

    // With every pass off, views and concatenations are copied by their kernels.
    const PlanOptions off{.prune = false, .alias = false, .reuse = false, .reorder = false};
    same_bits(run(precision, {.options = off, .with_gradients = differentiates()})(), results,
              fmt::format("{} in {}, passes off", name_, text(precision)));
    const std::set<std::string> seen = names_of(launched_variants(precision));
    const bool fits = has_local_memory_for(device_of(devices_, precision), case_, precision);
    for (const std::string& kernel : case_.kernels)
      if (fits && !seen.count(kernel)) fault("{} in {} did not launch {}", name_, text(precision), kernel);

    same_bits(run(precision, {.wrap = true, .with_gradients = differentiates()})(), results,
              fmt::format("{} in {}, as slices of bigger tensors", name_, text(precision)));
  }

  std::vector<Tensor> without_gradients(const std::vector<Tensor>& results) const {
    std::vector<Tensor> rest;
    for (std::size_t i = 0; i < results.size(); ++i)
      if (!is_gradient(i)) rest.push_back(results[i]);
    return rest;
  }

  /// False when there is nothing to compare.
  bool against_reference(Precision precision, const std::vector<Tensor>& want) {
    const std::vector<Tensor> got = without_gradients(results_[precision]);
    if (got.size() != want.size()) {
      fault("{}: the reference gives another number of tensors ({}, expected {})", name_, want.size(), got.size());
      return false;
    }
    for (std::size_t i = 0; i < want.size(); ++i) {
      const double magnitude = case_.magnitude > 0 ? case_.magnitude : std::max(largest(want[i]), 1e-30);
      const double share = close(got[i], want[i], case_.roundings * epsilon(precision) * magnitude,
                                 fmt::format("{} in {} against the reference, output {}", name_, text(precision), i));
      if (precision == Precision::Single) {
        findings_.value_error = worse(findings_.value_error, share);
        findings_.value_ulps = worse(findings_.value_ulps, share * case_.roundings);
      }
    }
    return true;
  }

  void float_against_double() {
    const double gradient_roundings = case_.gradient_roundings > 0 ? case_.gradient_roundings : 4 * case_.roundings;
    const std::vector<Tensor>&single = results_[Precision::Single], &twin = results_[Precision::Double];
    for (std::size_t i = 0; i < single.size(); ++i) {
      const bool is_slope = is_gradient(i);
      const double magnitude = !is_slope && case_.magnitude > 0 ? case_.magnitude : std::max(largest(twin[i]), 1e-30);
      const double roundings = is_slope ? gradient_roundings : case_.roundings;
      of_slopes_ = is_slope;
      const double share = close(single[i], twin[i], roundings * FLT_EPSILON * magnitude,
                                 fmt::format("{}, float against double, {} {}", name_, is_slope ? "gradient" : "output",
                                             is_slope ? i - outputs_ : i));
      of_slopes_ = false;
      findings_.twin_error = worse(findings_.twin_error, share);
      double& ulps = is_slope ? findings_.gradient_ulps : findings_.value_ulps;
      ulps = worse(ulps, share * roundings);
    }
  }

  /// What is no number must not be taken for one: a maximum or a clamp that drops it hides that a net has failed.
  void nan_is_not_hidden() {
    OpRun moving = run(Precision::Single);
    const std::vector<Tensor> base = moving();
    for (const auto& [name, tensor] : all_tensors(case_)) {
      const double step = 2 * largest(tensor) + 1;
      for (std::size_t k = 0; k < std::min<std::size_t>(tensor.real.size(), 4); ++k) {
        const std::size_t i = (2 * k + 1) * tensor.real.size() / 8;  // a few, spread
        const auto with = [&](double value) {
          Tensor moved = tensor;
          moved.real[i] = value;
          moving.move(name, moved);
          return moving();
        };
        const std::vector<Tensor> high = with(tensor.real[i] + step), low = with(tensor.real[i] - step),
                                  none = with(NAN);
        const Places hidden = places(base, [&](std::size_t o, std::size_t at) {
          const double value = base[o].real[at];
          return (high[o].real[at] != value || low[o].real[at] != value) && !std::isnan(none[o].real[at]);
        });
        if (hidden.empty()) continue;
        const auto [o, at] = *hidden.begin();
        fault("{} hides a NaN in element {} of {}: output {}, element {} is {}", name_, i, name, o, at,
              none[o].real[at]);
      }
      moving.move(name, tensor);
    }
  }

  /// The adjoint in double against central differences.
  void differences() {
    OpRun moving = run(Precision::Double);
    const std::vector<Tensor>& results = results_[Precision::Double];
    of_slopes_ = true;
    for (std::size_t d = 0; d < case_.differentiate.size(); ++d)
      differences_by(case_.differentiate[d], results[outputs_ + d], d + 1, moving);
    of_slopes_ = false;
  }

  void differences_by(const std::string& name, const Tensor& adjoint, std::size_t seed, OpRun& moving) {
    const Tensor base = case_.inputs.count(name) ? case_.inputs.at(name) : case_.states.at(name);
    const double scale = std::max(largest(adjoint), 1e-30);
    const std::size_t count = base.real.size();
    const std::size_t moves = std::min(count, static_cast<std::size_t>(case_.differences));
    if (moves == 0) return fault("{}: no element of {} is moved", name_, name);
    std::mt19937_64 random(seed);
    double worst = 0;
    std::string at;
    for (std::size_t m = 0; m < moves; ++m) {
      const std::size_t i = moves == count ? m : random() % count;
      double sides[2];
      for (const int side : {0, 1}) {
        Tensor moved = base;
        moved.real[i] += side ? case_.step : -case_.step;
        moving.move(name, moved);
        sides[side] = weighted_sum(moving(), cotangents_);
      }
      const double difference = (sides[1] - sides[0]) / (2 * case_.step);
      const double error = std::abs(difference - adjoint.real[i]) / scale;
      if (error <= worst) continue;
      worst = error, at = fmt::format("element {}: adjoint {}, difference {}", i, adjoint.real[i], difference);
      if (std::isnan(error)) break;
    }
    moving.move(name, base);
    findings_.gradient_error = worse(findings_.gradient_error, share_of(worst, case_.gradient_tolerance));
    if (!(worst <= case_.gradient_tolerance))
      fault("{}: gradient of {}, {}: error {} of the largest, allowed {}", name_, name, at, worst,
            case_.gradient_tolerance);
  }

  /// An error as a share of what is allowed; what is no number is as wrong as can be.
  static double share_of(double error, double allowed) {
    if (std::isnan(error)) return INFINITY;
    return error == 0 ? 0 : error / allowed;
  }

  /// The largest error as a share of `tolerance`; a fault when it is over one.
  double close(const Tensor& got, const Tensor& want, double tolerance, const std::string& what) {
    if (got.shape.text() != want.shape.text()) {
      fault("{}: {} instead of {}", what, got.shape.text(), want.shape.text());
      return INFINITY;
    }
    if (want.type() == Type::Int || got.integer.size() != want.integer.size()) return same_integers(got, want, what);
    if (got.real.size() != want.real.size()) {
      fault("{}: {} numbers instead of {}", what, got.real.size(), want.real.size());
      return INFINITY;
    }
    double worst = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < want.real.size(); ++i) {
      if (got.real[i] == want.real[i]) continue;  // also equal infinities
      const double error = std::abs(got.real[i] - want.real[i]);
      if (!(error <= worst)) worst = error, at = i;  // a NaN is the worst
      if (std::isnan(error)) break;
    }
    if (!(worst <= tolerance))
      fault("{}, element {} of {}: {} instead of {}, {} allowed", what, at, want.shape.text(), got.real[at],
            want.real[at], tolerance);
    return share_of(worst, tolerance);
  }

  double same_integers(const Tensor& got, const Tensor& want, const std::string& what) {
    if (got.integer == want.integer) return 0;
    if (got.integer.size() != want.integer.size()) {
      fault("{}: {} integers instead of {}", what, got.integer.size(), want.integer.size());
      return INFINITY;
    }
    const auto differ = std::ranges::mismatch(got.integer, want.integer);
    fault("{}, element {} of {}: {} instead of {}", what, differ.in1 - got.integer.begin(), want.shape.text(),
          *differ.in1, *differ.in2);
    return INFINITY;
  }

  void same_bits(const std::vector<Tensor>& a, const std::vector<Tensor>& b, const std::string& what) {
    if (a.size() != b.size()) return fault("{}: {} outputs instead of {}", what, a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      of_slopes_ = is_gradient(i);
      same_bits_of(
          a[i], b[i],
          of_slopes_ ? fmt::format("{}, gradient {}", what, i - outputs_) : fmt::format("{}, output {}", what, i));
      of_slopes_ = false;
    }
  }

  void same_bits_of(const Tensor& a, const Tensor& b, const std::string& what) {
    same_integers(a, b, what);
    if (a.real.size() != b.real.size())
      return fault("{}: {} numbers instead of {}", what, a.real.size(), b.real.size());
    long differ = 0;
    for (std::size_t k = 0; k < a.real.size(); ++k)
      differ += !(a.real[k] == b.real[k] || (std::isnan(a.real[k]) && std::isnan(b.real[k])));
    if (differ > 0) fault("{} of {}: {} elements differ", what, a.shape.text(), differ);
  }

  const OpCase& case_;  // rounded to float
  const CheckedDevices& devices_;
  OpFindings& findings_;
  const std::string name_;
  std::map<Precision, std::vector<Tensor>> results_;  // outputs, gradients, states
  std::size_t outputs_ = 0;                           // of them, in every run
  std::vector<Tensor> cotangents_;
  bool of_slopes_ = false;  // what is compared now is a gradient
  std::size_t slope_faults_ = 0, value_faults_ = 0;
};

/// True when the kernels of this stem have one body for CPUs and one for groups of work-items.
bool walks_rows(const std::string& stem) {
  return std::ranges::any_of(kernel_files(), [&](const std::string& file) {
    return file.ends_with("/" + stem + ".cl") && kernel_source(file).find("define GROUP_SCRATCH") != std::string::npos;
  });
}

/// True when a kernel of the case multiplies in a register tile, on a CPU.
bool multiplies_in_tiles(const OpCase& c) {
  static const std::set<std::string> kernels{
      "conv_cpu", "conv_weights_outer", "conv_weights_dot", "conv_winograd", "conv_winograd_gradient",
      "ask_mlp",  "ask_field",          "ray_mlp"};
  return std::ranges::any_of(c.kernels, [&](const std::string& kernel) { return kernels.count(kernel) > 0; });
}

}  // namespace

bool CheckedDevices::twins_run_elsewhere() const {
  return with_doubles && with_doubles->info().index != single.info().index;
}

CheckedDevices checked_devices(const Device& device) {
  if (device.has_double()) return {device, device};
  for (const DeviceInfo& info : list_devices()) try {
      if (info.fp64) return {device, Device::open(std::to_string(info.index))};
    } catch (const Error&) {  // the probe refuses it: the next
    }
  return {device, {}};
}

std::vector<Bodies> bodies_of(const OpCase& c) {
  std::vector<Bodies> all{Bodies::OfDevice};
  if (walks_rows(c.stem)) all.push_back(Bodies::InGroups);
  if (multiplies_in_tiles(c)) all.push_back(Bodies::InTiles);
  if (!c.product_kernels.empty()) all.push_back(Bodies::ByProducts);
  return all;
}

bool can_run(const Device& device, const OpCase& c, Bodies bodies) {
  const Precision widest = device.has_double() ? Precision::Double : Precision::Single;
  return device.info().max_group >= (bodies == Bodies::InGroups ? std::size_t{kGroup} : c.group) &&
         device.info().local_room() >= c.least_local_elements * real_size(widest) &&
         device.info().max_allocation >= c.piece_elements * real_size(Precision::Single);
}

bool has_local_memory_for(const Device& device, const OpCase& c, Precision precision) {
  return c.local_elements * real_size(precision) <= device.info().local_room();
}

void OpFindings::add(const OpFindings& other) {
  faults.insert(faults.end(), other.faults.begin(), other.faults.end());
  value_error = worse(value_error, other.value_error);
  twin_error = worse(twin_error, other.twin_error);
  gradient_error = worse(gradient_error, other.gradient_error);
  value_ulps = worse(value_ulps, other.value_ulps);
  gradient_ulps = worse(gradient_ulps, other.gradient_ulps);
  launched.insert(other.launched.begin(), other.launched.end());
  launched_in_double.insert(other.launched_in_double.begin(), other.launched_in_double.end());
  suspects.insert(other.suspects.begin(), other.suspects.end());
}

double worse(double a, double b) { return std::isnan(a) || b > a ? b : a; }

LaunchesSeen::~LaunchesSeen() {
  findings_.launched.merge(launched_variants(Precision::Single));
  findings_.launched_in_double.merge(launched_variants(Precision::Double));
}

OpFindings check_op(const OpCase& c, const CheckedDevices& devices, Bodies bodies) {
  OpFindings findings;
  OpCase named = rounded_to_float(c);
  std::optional<InGroups> groups;
  if (bodies == Bodies::InGroups) groups.emplace(kGroup), named.label += fmt::format(" in groups of {}", kGroup);
  std::optional<InClblast> clblast;
  if (bodies == Bodies::ByProducts)
    clblast.emplace(devices), named.label += " by products", named.kernels = named.product_kernels;
  try {
    Check check(named, devices, findings);
    {
      const LaunchesSeen seen(findings);
      if (bodies == Bodies::InTiles)
        check.tiles_agree();
      else
        check.everything();
    }
    if (!findings.faults.empty()) findings.suspects = check.suspects();
  } catch (const Error& e) {
    findings.faults.push_back(fmt::format("{}: {}", named.name(), e.what()));
    findings.suspects.insert(named.kernels.begin(), named.kernels.end());
  }
  return findings;
}

}  // namespace clerestory
