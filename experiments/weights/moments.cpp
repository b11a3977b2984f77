#include "experiments/weights/moments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "experiments/weights/metadata.hpp"
#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

const std::string kRows = "moments.rows.", kColumns = "moments.columns.", kSecond = "adam.v.";
constexpr const char* kSteps = "moment_steps";
constexpr double kLeast = 1e-30;                 // of a second moment; its logarithm fits into half precision
constexpr float kLeastLog = -70, kMostLog = 89;  // of what float can hold, with half precision's rounding

struct Split {
  std::size_t rows, columns;
};

/// The first side that is not 1 against the rest; a row of numbers stays one.
Split split_of(const Shape& s) {
  const auto count = static_cast<std::size_t>(s.count());
  for (const int side : {s.n, s.c, s.h}) {
    if (side == 1) continue;
    const auto rows = static_cast<std::size_t>(side);
    return count == rows ? Split{1, count} : Split{rows, count / rows};
  }
  return {1, count};
}

StoredTensor logarithms(const std::vector<double>& means) {
  std::vector<float> logs;
  for (const double v : means) logs.push_back(static_cast<float>(std::log(std::max(v, kLeast))));
  const long count = static_cast<long>(logs.size());
  return StoredTensor({count}, std::move(logs));
}

std::vector<double> means_of(const Moments& moments, const std::string& name, std::size_t count,
                             const std::string& where) {
  const auto found = moments.tensors.find(name);
  if (found == moments.tensors.end() || found->second.count() != count)
    throw usage_error("factors of second moments do not fit their parameter", where + ": " + name,
                      found == moments.tensors.end() ? "none" : fmt::format("{} numbers", found->second.count()),
                      fmt::format("{}", count));
  std::vector<double> means;
  for (const float v : found->second.floats(where + ": " + name)) {
    if (!(v >= kLeastLog && v <= kMostLog))
      throw usage_error("a logarithm of second moments is out of range", where + ": " + name, fmt::format("{}", v),
                        fmt::format("{} to {}", kLeastLog, kMostLog));
    means.push_back(std::exp(static_cast<double>(v)));
  }
  return means;
}

void add_factors(Moments& moments, const std::string& parameter, const Shape& shape, const std::vector<float>& second) {
  const Split split = split_of(shape);
  std::vector<double> rows(split.rows), columns(split.columns);
  for (std::size_t r = 0; r < split.rows; ++r)
    for (std::size_t c = 0; c < split.columns; ++c) {
      const auto v = static_cast<double>(second[r * split.columns + c]);
      rows[r] += v / static_cast<double>(split.columns), columns[c] += v / static_cast<double>(split.rows);
    }
  moments.tensors[kRows + parameter] = logarithms(rows), moments.tensors[kColumns + parameter] = logarithms(columns);
}

constexpr int kMostSteps = std::numeric_limits<int>::max();

/// Of a checkpoint, which has them whole.
Moments checkpoint_moments(const TensorFile& file, const std::string& where) {
  Moments moments{whole_fact(file, "step", where, 0, kMostSteps) + earlier_moment_steps(file, where), {}};
  for (const auto& [name, tensor] : file.tensors)
    if (name.starts_with(kSecond) && tensor.shape.size() == 4) {
      if (tensor.count() == 0)
        throw usage_error("second moments of no parameter", where + ": " + name, shape_text(tensor.shape));
      const auto side = [&shape = tensor.shape](std::size_t i) { return static_cast<int>(shape[i]); };
      add_factors(moments, name.substr(kSecond.size()), {side(0), side(1), side(2), side(3)}, tensor.floats(where));
    }
  return moments;
}

}  // namespace

Moments factored_moments(const States& states, std::int64_t steps) {
  Moments moments{steps, {}};
  for (const std::string& name : states.names()) {
    if (!name.starts_with(kSecond)) continue;
    const Tensor second = states.get(name);
    add_factors(moments, name.substr(kSecond.size()), second.shape, second.floats());
  }
  return moments;
}

bool set_moments(States& states, const Moments& moments, const std::string& where) {
  std::vector<std::string> names = states.names();
  std::erase_if(names, [](const std::string& name) { return !name.starts_with(kSecond); });
  for (const std::string& name : names)
    if (!moments.tensors.contains(kRows + name.substr(kSecond.size()))) return false;
  for (const std::string& name : names) {
    const std::string parameter = name.substr(kSecond.size());
    Tensor second = states.get(name);
    const Split split = split_of(second.shape);
    const std::vector<double> rows = means_of(moments, kRows + parameter, split.rows, where);
    const std::vector<double> columns = means_of(moments, kColumns + parameter, split.columns, where);
    double mean = 0;
    for (const double v : rows) mean += v / static_cast<double>(split.rows);
    for (std::size_t r = 0; r < split.rows; ++r)
      for (std::size_t c = 0; c < split.columns; ++c) second.real[r * split.columns + c] = rows[r] * columns[c] / mean;
    states.set(name, second);
  }
  return true;
}

Moments moments_of_others(const Moments& moments, const States& states) {
  Moments others;
  for (const std::string& prefix : {kRows, kColumns})
    for (const auto& [name, tensor] : moments.tensors)
      if (name.starts_with(prefix) && !states.has(kSecond + name.substr(prefix.size()))) others.tensors[name] = tensor;
  if (!others.tensors.empty()) others.steps = moments.steps;
  return others;
}

Moments joined(Moments first, const Moments& more) {
  if (more.steps == 0) return first;
  first.steps = first.steps == 0 ? more.steps : std::min(first.steps, more.steps);
  first.tensors.insert(more.tensors.begin(), more.tensors.end());
  return first;
}

void store_moments(TensorFile& file, const Moments& moments, const std::string& prefix) {
  if (moments.steps == 0) return;
  for (const auto& [name, tensor] : moments.tensors)
    if (name.starts_with(kRows + prefix) || name.starts_with(kColumns + prefix)) file.tensors[name] = tensor;
  file.metadata[kSteps] = std::to_string(moments.steps);
}

std::int64_t earlier_moment_steps(const TensorFile& file, const std::string& where) {
  return file.metadata.contains(kEarlierSteps) ? whole_fact(file, kEarlierSteps, where, 0, kMostSteps) : 0;
}

Moments stored_moments(const TensorFile& file, const std::string& where) {
  const auto kind = file.metadata.find("kind");
  const bool checkpoint = kind != file.metadata.end() && kind->second == "checkpoint";
  return checkpoint ? joined(checkpoint_moments(file, where), kept_moments(file, where)) : kept_moments(file, where);
}

Moments kept_moments(const TensorFile& file, const std::string& where) {
  Moments moments;
  if (!file.metadata.contains(kSteps)) return moments;
  moments.steps = whole_fact(file, kSteps, where, 1, kMostSteps);
  for (const auto& [name, tensor] : file.tensors)
    if (name.starts_with(kRows) || name.starts_with(kColumns)) moments.tensors[name] = tensor;
  return moments;
}

}  // namespace clerestory
