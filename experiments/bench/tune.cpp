#include "experiments/bench/tune.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "experiments/bench/bench.hpp"
#include "experiments/bench/tune_trials.hpp"
#include "host/cl/seconds_of.hpp"
#include "host/cl/tile.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/nn/clblast_parameters.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/gemm.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

constexpr double comparison_seconds = 60;  // kept for the comparison at the end
constexpr double least_gain = 0.02;        // below it a set is not worth keeping
constexpr double most_loss = 0.05;         // of one product, as far as noise allows to say so
constexpr double unmeasured = std::numeric_limits<double>::infinity();
constexpr std::size_t never = 1, always = 1u << 20;  // sizes below which every product, or none, is indirect

// --- The search

/// What the products from `first` on say of a set.
ClblastTrial trial_of(const ClblastValues& values, const std::vector<Product>& products,
                      const std::vector<ProductTrial>& measured, std::size_t first, std::size_t end) {
  ClblastTrial trial{values, 0, 0, {}};
  for (const ProductTrial& product : measured)
    if (trial.fault.empty()) trial.fault = product.fault;
  if (!trial.fault.empty()) return trial;
  std::vector<double> gains;
  for (std::size_t i = first; i < end; ++i)
    if (products[i].timed) gains.push_back(std::log(measured[i].own / measured[i].seconds));
  trial.gain = std::exp(mean(gains)), trial.least = std::exp(*std::ranges::min_element(gains));
  return trial;
}

class Search {
 public:
  Search(Device& device, const TuneOptions& options)
      : trials_(device, options.again), own_(clblast_defaults(device)), options_(options), device_(device) {}

  /// True when there is nothing left to try.
  bool run(const Stopwatch& watch) {
    const double budget = options_.minutes * 60, until = budget - comparison_seconds;
    Progress progress("tune", std::llround(budget), "seconds");
    double slowest = 0;
    for (int tried = 0;; ++tried) {
      const ClblastSets sets = next();
      if (sets.empty()) return true;
      if (tried == options_.most_sets && tried > 0) return false;
      if (tried > 0 && watch.seconds() + slowest > until) return false;
      stop_if_interrupted("tune");
      const double before = watch.seconds();
      trials_.begin(sets);
      measure(sets);
      trials_.end();
      slowest = std::max(slowest, watch.seconds() - before);
      progress.update(
          std::llround(watch.seconds()),
          fmt::format("{} sets, {:.2f} times CLBlast's own on large products, {:.2f} on small ones", trials_.sets(),
                      std::max(trials_.search("Xgemm").best_gain(), trials_.search("Copies").best_gain()),
                      trials_.search("XgemmDirect").best_gain()));
    }
  }

  int sets() const { return trials_.sets(); }

  /// The best of each kernel; of a search that is over, with the size from which the indirect kernel is used.
  ClblastParameters found(bool over) {
    ClblastParameters parameters = trials_.parameters();
    if (over && !parameters.empty()) choose_route(parameters);
    return parameters;
  }

 private:
  /// Both products' kernels at once, for CLBlast compiles them together; then the ones that copy.
  ClblastSets next() {
    ClblastSets sets;
    for (const char* kernel : {"Xgemm", "XgemmDirect"})
      if (const auto values = trials_.search(kernel).next()) sets[kernel] = *values;
    if (sets.empty())
      if (const auto values = trials_.search("Copies").next()) sets["Copies"] = *values;
    return sets;
  }

  void measure(const ClblastSets& sets) {
    const std::vector<ProductTrial> measured = meter().measure(routed(sets));
    const bool refused = std::ranges::any_of(measured, [](const ProductTrial& p) { return !p.fault.empty(); });
    if (refused && sets.size() > 1) {  // which of them is it?
      for (const auto& [kernel, values] : sets) measure({{kernel, values}});
      return;
    }
    const std::size_t large = options_.large.size(), all = meter().products().size();
    for (const auto& [kernel, values] : sets) {
      const bool small = kernel == "XgemmDirect";
      trials_.search(kernel).trials.push_back(
          trial_of(values, meter().products(), measured, small ? large : 0, small ? all : large));
    }
  }

  /// Large products go to the indirect kernel and small ones to the direct one.
  ClblastParameters routed(const ClblastSets& sets) const {
    ClblastParameters parameters = trials_.parameters(sets);
    double small = 1, large = 1e300;
    for (const Product& p : options_.small) small = std::max(small, p.volume());
    for (const Product& p : options_.large) large = std::min(large, p.volume());
    const double own = std::pow(static_cast<double>(own_.at("GemmRoutine").at("XGEMM_MIN_INDIRECT_SIZE")), 3);
    if (own <= small || own > large)
      parameters["GemmRoutine"] = {
          {"XGEMM_MIN_INDIRECT_SIZE", static_cast<std::size_t>(std::cbrt(std::sqrt(small * large))) + 1}};
    return parameters;
  }

  void choose_route(ClblastParameters& parameters) {
    const auto seconds = [&](std::size_t from) {
      parameters["GemmRoutine"] = {{"XGEMM_MIN_INDIRECT_SIZE", from}};
      return meter().measure(parameters);
    };
    const std::vector<ProductTrial> indirect = seconds(never), direct = seconds(always);
    std::vector<DirectOrNot> products;
    for (std::size_t i = 0; i < direct.size(); ++i) {
      if (!direct[i].fault.empty() || !indirect[i].fault.empty()) products.clear();
      if (!direct[i].fault.empty() || !indirect[i].fault.empty()) break;
      if (meter().products()[i].timed)
        products.push_back({meter().products()[i].volume(), direct[i].seconds, indirect[i].seconds});
    }
    const std::size_t own = own_.at("GemmRoutine").at("XGEMM_MIN_INDIRECT_SIZE");
    parameters["GemmRoutine"]["XGEMM_MIN_INDIRECT_SIZE"] = indirect_from(std::move(products), own);
    if (parameters["GemmRoutine"] == own_.at("GemmRoutine")) parameters.erase("GemmRoutine");
  }

  /// Made when it is first needed: its references take seconds.
  ClblastMeter& meter() {
    if (!meter_) {
      std::vector<Product> products = options_.large;
      products.insert(products.end(), options_.small.begin(), options_.small.end());
      meter_ = std::make_unique<ClblastMeter>(device_, std::move(products), options_.rounds);
    }
    return *meter_;
  }

  TuneTrials trials_;
  ClblastParameters own_;
  const TuneOptions& options_;
  Device& device_;
  std::unique_ptr<ClblastMeter> meter_;
};

// --- The comparison

/// Work in both backends.
struct Compared {
  TuningFigure figure;
  Graph graph;
  std::unique_ptr<Executor> clblast, packed;
  double again = unmeasured;  // by CLBlast's own parameters, the other half of its runs
};

using Inputs = std::vector<std::pair<std::string, Shape>>;

/// `build` makes the result of the inputs.
std::unique_ptr<Compared> compiled(Device& device, const std::string& work, double flops, const Inputs& inputs,
                                   const std::function<Value(const std::vector<Value>&)>& build) {
  auto c = std::make_unique<Compared>();
  c->figure = {work, flops, unmeasured, unmeasured, unmeasured};
  std::vector<Value> values;
  for (const auto& [name, shape] : inputs) values.push_back(c->graph.input(name, shape));
  const Value result = build(values);
  c->clblast = std::make_unique<Executor>(compile(c->graph, {result}, device, {.gemm = "clblast"}));
  c->packed = std::make_unique<Executor>(compile(c->graph, {result}, device, {.gemm = "packed"}));
  for (Executor* run : {c->clblast.get(), c->packed.get()})
    for (const auto& [name, shape] : inputs) run->feed(name, noise(shape, static_cast<std::uint32_t>(name[0])));
  return c;
}

std::vector<std::unique_ptr<Compared>> compared_works(Device& device, const TuneOptions& options) {
  std::vector<std::unique_ptr<Compared>> works;
  for (const Product& p : options.products)
    works.push_back(compiled(device, "product " + p.text(), p.flops(),
                             {{"a", {1, 1, p.rows, p.depth}}, {"b", {1, 1, p.depth, p.columns}}},
                             [](const std::vector<Value>& in) { return matmul(in[0], in[1]); }));
  for (const TunedLayer& layer : options.layers) {
    const Shape y{layer.x.n, layer.w.n, layer.x.h, layer.x.w};
    const double flops = 2.0 * static_cast<double>(y.count()) * static_cast<double>(layer.w.item());
    const auto pass = [&](const std::string& name, int input) {
      works.push_back(compiled(device, fmt::format("conv {} by {}, {}", layer.x.text(), layer.w.text(), name), flops,
                               {{"x", layer.x}, {"w", layer.w}, {"dy", y}}, [&](const std::vector<Value>& in) {
                                 const Value out = conv(in[0], in[1], {}, {.stride = 1, .pad = layer.w.h / 2});
                                 return input < 0 ? out
                                                  : gradient(std::vector{out}, std::vector{in[2]},
                                                             std::vector{in[static_cast<std::size_t>(input)]})[0];
                               }));
    };
    pass("forward", -1), pass("data", 0), pass("weights", 1);
  }
  return works;
}

/// Turn by turn, so that what else the machine does hits all of them.
std::vector<std::unique_ptr<Compared>> compare(Device& device, const TuneOptions& options,
                                               const ClblastParameters& found) {
  std::vector<std::unique_ptr<Compared>> works = compared_works(device, options);
  const auto timed = [&](Executor& run, const ClblastParameters& by, double& best, int round) {
    use_clblast_parameters(device, by);
    const double seconds = seconds_of(device, [&] { run.run(); });
    if (round > 0) best = std::min(best, seconds);  // the first builds
  };
  for (int round = 0; round <= options.rounds; ++round)
    for (const auto& c : works) {
      timed(*c->clblast, {}, c->figure.untuned, round);
      timed(*c->clblast, found, c->figure.tuned, round);
      timed(*c->clblast, {}, c->again, round);
      timed(*c->packed, {}, c->figure.packed, round);
    }
  return works;
}

/// What was measured, and whether the parameters take the place of CLBlast's own.
void judge(const std::vector<std::unique_ptr<Compared>>& works, Tuning& tuning) {
  std::vector<double> gains, differences, over_packed;
  bool loses = false;
  for (const auto& c : works) {
    TuningFigure figure = c->figure;
    const double difference = std::abs(std::log(figure.untuned / c->again));
    figure.untuned = std::min(figure.untuned, c->again);
    const double gain = std::log(figure.untuned / figure.tuned);
    loses = loses || gain < -std::max(most_loss, difference);
    gains.push_back(gain), differences.push_back(difference);
    tuning.figures.push_back(figure);
  }
  tuning.noise = mean(differences);
  if (!tuning.clblast.empty() && (loses || mean(gains) < std::max(least_gain, tuning.noise))) {
    say(fmt::format("the best parameters found are {:.2f} times as fast as CLBlast's own{}: CLBlast's own stay",
                    std::exp(mean(gains)), loses ? ", and slower somewhere" : ""));
    tuning.clblast.clear();
  }
  for (TuningFigure& figure : tuning.figures) {
    if (tuning.clblast.empty()) figure.tuned = figure.untuned;
    over_packed.push_back(std::log(figure.tuned / figure.packed));
  }
  tuning.gemm = mean(over_packed) > 0 ? "packed" : "clblast";
}

std::string gflops(double flops, double seconds) { return fmt::format("{:.1f}", flops / seconds * 1e-9); }

std::string parameters_text(const ClblastParameters& parameters) {
  std::string text;
  for (const auto& [kernel, values] : parameters) {
    text += "  " + kernel + ":";
    for (const auto& [name, value] : values) text += fmt::format(" {}={}", name, value);
    text += "\n";
  }
  return text.empty() ? "  CLBlast's own\n" : text;
}

}  // namespace

TuneOptions tune_options() {
  TuneOptions o;
  // A product of odd sizes is checked and not timed. Those with a transposed factor are what gradients need.
  o.large = {{64, 9600, 576},
             {128, 2400, 1152},
             {512, 300, 2304},
             {576, 9600, 64, true},
             {64, 576, 9600, false, true},
             {61, 1003, 3301, false, false, false}};
  o.small = {{64, 1280, 576},
             {128, 300, 1152},
             {32, 4800, 288},
             {288, 1280, 32, true},
             {64, 576, 1280, false, true},
             {37, 211, 97, true, false, false}};
  o.products = {{512, 512, 512}, {64, 19200, 576}, {128, 4800, 1152}, {512, 300, 4608}, {32, 19200, 1152}};
  o.layers = {{{1, 64, 60, 80}, {64, 64, 3, 3}},
              {{1, 256, 30, 40}, {128, 256, 3, 3}},
              {{8, 32, 64, 80}, {16, 32, 3, 3}},
              {{1, 128, 60, 80}, {64, 128, 1, 1}}};
  return o;
}

bool is_finished(const Tuning& tuning) {
  return tuning.complete && tuning.clblast_version == clblast_version() && tuning.kernels == gemm_kernels();
}

Tuning tune(Device& device, const TuneOptions& options) {
  const std::filesystem::path file = tuning_file();
  if (file.empty()) throw usage_error("no place for what is measured", "HOME", "", "a folder, or XDG_DATA_HOME");
  read_tunings(file);  // one that is damaged is an error before the work
  make_directories(file.parent_path());
  const FileLock lock(file.string() + ".lock", LockKind::Write, file);
  const Stopwatch watch;
  Tuning tuning;
  tuning.device = device.fingerprint(), tuning.kind = tuning_kind(device.info());
  tuning.clblast_version = clblast_version(), tuning.kernels = gemm_kernels();
  if (options.again) remeasured_tile(device);
  device.use_tile("auto");
  tuning.tile = device.tile().name;
  Search search(device, options);
  tuning.complete = search.run(watch);
  tuning.sets = search.sets();
  tuning.clblast = search.found(tuning.complete);
  stop_if_interrupted("tune");
  judge(compare(device, options, tuning.clblast), tuning);
  tuning.measured = utc_now();
  use_clblast_parameters(device, tuning.clblast);
  keep_tuning(tuning);
  if (!tuning.complete)
    say(fmt::format("tune: {} sets tried in all; there are more, the same command goes on", tuning.sets));
  return tuning;
}

std::size_t indirect_from(std::vector<DirectOrNot> products, std::size_t own) {
  std::ranges::sort(products, {}, &DirectOrNot::volume);
  const auto cost = [&](double from) {
    double sum = 0;
    for (const DirectOrNot& p : products) sum += std::log(p.volume < from * from * from ? p.direct : p.indirect);
    return sum;
  };
  std::vector<double> sizes{static_cast<double>(never), static_cast<double>(always)};
  for (std::size_t i = 1; i < products.size(); ++i)
    sizes.push_back(std::ceil(std::cbrt(std::sqrt(products[i - 1].volume * products[i].volume))));
  const double best = *std::ranges::min_element(sizes, {}, cost);
  constexpr double equal = 0.01;  // the noise of a good machine, of the mean over products
  const double own_size = static_cast<double>(own);
  if (cost(own_size) - cost(best) <= equal * static_cast<double>(products.size())) return own;
  return static_cast<std::size_t>(best);
}

std::string tuning_text(const TuningInUse& used) {
  const Tuning& t = used.tuning;
  std::string text = fmt::format("{}\n{}, measured {}{}\n\n", t.device, used.file.string(), t.measured,
                                 used.shipped ? ", came with the program" : "");
  text += fmt::format("{:<46}{:>9}{:>9}{:>9}   {}\n", "GFLOP/s", "CLBlast", "tuned", "packed", "fastest");
  double tuned = 0, packed = 0;
  for (const TuningFigure& f : t.figures) {
    text += fmt::format("{:<46}{:>9}{:>9}{:>9}   {}\n", f.work, gflops(f.flops, f.untuned), gflops(f.flops, f.tuned),
                        gflops(f.flops, f.packed), f.tuned < f.packed ? "clblast" : "packed");
    tuned += std::log(f.untuned / f.tuned), packed += std::log(f.tuned / f.packed);
  }
  const auto count = static_cast<double>(std::max<std::size_t>(t.figures.size(), 1));
  text += fmt::format(
      "geometric means: tuned {:.2f} times CLBlast's own (which differs from itself by {:.1f} %), packed {:.2f} times "
      "that\n",
      std::exp(tuned / count), 100 * t.noise, std::exp(packed / count));
  text += fmt::format("auto: {}; register tile {}; CLBlast {} by {} sets{}:\n", t.gemm, t.tile, t.clblast_version,
                      t.sets, t.complete ? "" : ", the search is not over");
  return text + parameters_text(t.clblast);
}

}  // namespace clerestory
