// One table, four dresses: text for the terminal, Markdown, JSON, and HTML (html.hpp).
#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace clerestory {

/// A measured quantity: mean over `count` runs and their standard deviation (0 and hidden for a single one).
struct Measure {
  double mean = 0;
  double deviation = 0;
  int count = 1;
};

/// Mean and standard deviation (n - 1) of samples; throws on an empty list.
Measure measure_of(const std::vector<double>& samples);

/// Nothing, words, or a number.
using Cell = std::variant<std::monostate, std::string, Measure>;

/// measure_of, or nothing for an empty list.
Cell measure_or_nothing(const std::vector<double>& samples);

enum class Best { None, Lowest, Highest };

struct Column {
  std::string name;
  std::string unit = {};   // shown under the name
  Best best = Best::None;  // which numbers of this column are set in bold
  int digits = 3;          // significant digits
};

struct Table {
  std::string title;
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;  // each as long as `columns`
  std::string note = {};  // sentences below the title: which maps, clamp, epsilon, what the spread is over

  void add(std::vector<Cell> row);  // throws when the length differs
};

/// "0.123 ± 0.004" with the column's digits; "-" for nothing.
std::string cell_text(const Cell& cell, const Column& column);
/// Whether the cell holds the best mean of its column (finite ones compete; ties all count as best).
bool is_best(const Table& table, std::size_t row, std::size_t column);

std::string table_text(const Table& table);  // aligned, the best marked with *
std::string table_markdown(const Table& table);
std::string table_json(const Table& table);
/// Reads what table_json wrote. Throws ErrorKind::Usage naming `name`.
Table table_from_json(const std::string& json, const std::string& name);

}  // namespace clerestory
