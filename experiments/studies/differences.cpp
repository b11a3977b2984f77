#include "experiments/studies/differences.hpp"

#include <fmt/ranges.h>

#include <cmath>
#include <string>
#include <vector>

#include "host/math/welch.hpp"

namespace clerestory {
namespace {

constexpr double kChance = 0.05;

using Texts = std::vector<std::string>;

/// What tells rows apart: which variant, and which row of its table.
struct RowKey {
  Texts variant, words;
};

RowKey key_of(const std::vector<Cell>& row, std::size_t named, std::size_t front) {
  RowKey key;
  for (std::size_t c = 0; c < row.size(); ++c)
    if (const auto* text = std::get_if<std::string>(&row[c])) {
      if (c < named) key.variant.push_back(*text);
      if (c >= front) key.words.push_back(*text);
    }
  return key;
}

Cell difference(const Cell& mine, const Cell& first) {
  const auto *a = std::get_if<Measure>(&mine), *b = std::get_if<Measure>(&first);
  if (!a || !b || !std::isfinite(a->mean) || !std::isfinite(b->mean)) return {};
  if (a->count < 2 || b->count < 2) return "one seed";
  const auto square = [](const Measure& m) { return m.deviation * m.deviation / m.count; };  // of the standard error
  const double d = a->mean - b->mean;
  const double p = p_of_shifts({{d, {square(*a), square(*b)}, {a->count, b->count}}}).value_or(d == 0 ? 1 : 0);
  return p > kChance ? "none" : fmt::format("{:+.3g}", d);
}

}  // namespace

Table with_differences(const Table& table, std::size_t named) {
  if (table.rows.empty() || named == 0) return table;
  const bool counted = table.columns.size() > named && table.columns[named].name == "runs";
  const std::size_t front = named + counted;
  const Texts first = key_of(table.rows[0], named, front).variant;
  const auto of_first = [&](const Texts& words) -> const std::vector<Cell>* {
    for (const auto& row : table.rows)
      if (const RowKey key = key_of(row, named, front); key.variant == first && key.words == words) return &row;
    return nullptr;
  };

  Table out;
  out.title = table.title, out.note = table.note;
  for (const Column& column : table.columns) {
    out.columns.push_back(column);
    if (column.best != Best::None)
      out.columns.push_back({"difference", fmt::format("to {}", fmt::join(first, " ")), Best::None, 3});
  }
  for (const auto& row : table.rows) {
    const RowKey key = key_of(row, named, front);
    const auto* reference = key.variant == first ? nullptr : of_first(key.words);
    std::vector<Cell> cells;
    for (std::size_t c = 0; c < row.size(); ++c) {
      cells.push_back(row[c]);
      if (table.columns[c].best != Best::None)
        cells.push_back(reference ? difference(row[c], (*reference)[c]) : Cell());
    }
    out.add(std::move(cells));
  }
  return out;
}

}  // namespace clerestory
