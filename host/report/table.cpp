// Tables as text, Markdown and JSON.
#include "host/report/table.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nesting.hpp"
#include "host/math/statistics.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

using Json = nlohmann::ordered_json;

const Measure* measure(const Cell& cell) { return std::get_if<Measure>(&cell); }

/// Characters, not bytes, of UTF-8: columns hold a plus-minus sign.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xc0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string space(width - std::min(width, width_of(text)), ' ');
  return right ? space + text : text + space;
}

std::string heading(const Column& column) {
  return column.unit.empty() ? column.name : column.name + " [" + column.unit + "]";
}

bool is_numeric(const Table& table, std::size_t column) {
  return std::ranges::any_of(table.rows, [&](const auto& row) { return measure(row[column]) != nullptr; });
}

/// `digits` significant digits, without an exponent from 1e-4 to a million; `whole`: integers without a point ("1024").
std::string number(double value, int digits, bool whole) {
  if (!std::isfinite(value)) return fmt::format("{}", value);
  const double size = std::abs(value);
  if (whole && size < 1e6 && value == std::floor(value)) return fmt::format("{:.0f}", value);
  if (size != 0 && (size < 1e-4 || size >= 1e6)) return fmt::format("{:.{}e}", value, digits - 1);
  const int before_point = size == 0 ? 1 : static_cast<int>(std::floor(std::log10(size))) + 1;
  return fmt::format("{:.{}f}", value, std::max(0, digits - before_point));
}

/// The deviation with as many decimals as the mean shows, so that both can be read as one number.
std::string deviation_like(const std::string& mean, double deviation, int digits) {
  if (mean.find('e') != std::string::npos || !std::isfinite(deviation))
    return number(deviation, std::max(1, digits - 1), false);
  const auto point = mean.find('.');
  const int decimals = point == std::string::npos ? 0 : static_cast<int>(mean.size() - point - 1);
  const std::string text = fmt::format("{:.{}f}", deviation, decimals);
  return std::stod(text) == 0 && deviation > 0 ? number(deviation, 1, false) : text;
}

Json cell_json(const Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  if (const Measure* m = measure(cell)) {
    // JSON has no NaN: a mean that is not finite becomes null.
    const auto finite = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
    return {{"mean", finite(m->mean)}, {"deviation", finite(m->deviation)}, {"count", m->count}};
  }
  return nullptr;
}

Cell cell_of(const Json& json, const std::string& name) {
  if (json.is_null()) return {};
  if (json.is_string()) return json.get<std::string>();
  const auto real = [&](const char* key) { return json.at(key).is_null() ? std::nan("") : json.at(key).get<double>(); };
  return Measure{real("mean"), real("deviation"), whole_number<int>(json.at("count"), "count", name)};
}

constexpr int kMostDigits = 17;  // all that a double has
const char* const kBest[] = {"none", "lowest", "highest"};

}  // namespace

Measure measure_of(const std::vector<double>& samples) {
  return {mean(std::span<const double>(samples)), standard_deviation(std::span<const double>(samples)),
          static_cast<int>(samples.size())};
}

Cell measure_or_nothing(const std::vector<double>& samples) {
  return samples.empty() ? Cell{} : Cell{measure_of(samples)};
}

void Table::add(std::vector<Cell> row) {
  if (row.size() != columns.size())
    throw Error(ErrorKind::Failed, "row of another length", "table " + title, std::to_string(row.size()),
                std::to_string(columns.size()));
  rows.push_back(std::move(row));
}

std::string cell_text(const Cell& cell, const Column& column) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  const Measure* m = measure(cell);
  if (!m) return "-";
  const bool spread = m->count > 1 && std::isfinite(m->mean);
  const std::string text = number(m->mean, column.digits, !spread);
  return spread ? text + " \u00b1 " + deviation_like(text, m->deviation, column.digits) : text;
}

bool is_best(const Table& table, std::size_t row, std::size_t column) {
  const Best best = table.columns[column].best;
  const Measure* mine = measure(table.rows[row][column]);
  if (best == Best::None || !mine || !std::isfinite(mine->mean)) return false;
  return std::ranges::none_of(table.rows, [&](const auto& other) {
    const Measure* m = measure(other[column]);
    return m && std::isfinite(m->mean) && (best == Best::Lowest ? m->mean < mine->mean : m->mean > mine->mean);
  });
}

std::string table_text(const Table& table) {
  const std::size_t columns = table.columns.size();
  std::vector<std::vector<std::string>> cells(1);
  for (const Column& column : table.columns) cells[0].push_back(terminal_text(heading(column)));
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    cells.emplace_back();
    for (std::size_t c = 0; c < columns; ++c) {
      // Numbers stay below each other whether or not they carry the mark.
      const char* mark = table.columns[c].best == Best::None ? "" : is_best(table, r, c) ? " *" : "  ";
      cells.back().push_back(terminal_text(cell_text(table.rows[r][c], table.columns[c])) + mark);
    }
  }
  std::string text = table.title.empty() ? "" : terminal_text(table.title) + "\n";
  if (!table.note.empty()) text += terminal_text(table.note) + "\n";
  for (std::size_t r = 0; r < cells.size(); ++r) {
    std::string line;
    for (std::size_t c = 0; c < columns; ++c) {
      std::size_t width = 0;
      for (const auto& row : cells) width = std::max(width, width_of(row[c]));
      line += (c ? "  " : "") + padded(cells[r][c], width, is_numeric(table, c));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string table_markdown(const Table& table) {
  const auto cell = [](std::string text, bool bold) {
    for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
    std::ranges::replace_if(
        text, [](char c) { return c == '\n' || c == '\r'; }, ' ');  // would end the row
    return bold ? " **" + text + "** |" : " " + text + " |";
  };
  std::string text = table.title.empty() ? "" : "**" + table.title + "**\n\n";
  if (!table.note.empty()) text += table.note + "\n\n";
  text += "|";
  for (const Column& column : table.columns) text += cell(heading(column), false);
  text += "\n|";
  for (std::size_t c = 0; c < table.columns.size(); ++c) text += is_numeric(table, c) ? "---:|" : "---|";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    text += "\n|";
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      text += cell(cell_text(table.rows[r][c], table.columns[c]), is_best(table, r, c));
  }
  return text + "\n";
}

std::string table_json(const Table& table) {
  Json json = {{"title", table.title}};
  if (!table.note.empty()) json["note"] = table.note;
  json["columns"] = Json::array(), json["rows"] = Json::array();
  for (const Column& column : table.columns)
    json["columns"].push_back({{"name", column.name},
                               {"unit", column.unit},
                               {"best", kBest[static_cast<int>(column.best)]},
                               {"digits", column.digits}});
  for (const auto& row : table.rows) {
    Json cells = Json::array();
    for (const Cell& cell : row) cells.push_back(cell_json(cell));
    json["rows"].push_back(std::move(cells));
  }
  return json_text(json);
}

Table table_from_json(const std::string& text, const std::string& name) {
  check_nesting(text, name);
  try {
    const Json json = Json::parse(text);
    Table table;
    table.title = json.at("title").get<std::string>();
    table.note = json.value("note", "");
    for (const Json& column : json.at("columns")) {
      const auto best = std::ranges::find(kBest, column.at("best").get<std::string>());
      if (best == std::end(kBest)) throw usage_error("unknown direction in a table", name, column.at("best").dump());
      table.columns.push_back({column.at("name").get<std::string>(), column.at("unit").get<std::string>(),
                               static_cast<Best>(best - std::begin(kBest)),
                               whole_number<int>(column.at("digits"), "digits", name)});
      if (const int digits = table.columns.back().digits; digits < 1 || digits > kMostDigits)
        throw usage_error("wrong number of digits in a table", name, fmt::format("{}", digits),
                          fmt::format("1 to {}", kMostDigits));
    }
    for (const Json& row : json.at("rows")) {
      std::vector<Cell> cells;
      for (const Json& cell : row) cells.push_back(cell_of(cell, name));
      if (cells.size() != table.columns.size())
        throw usage_error("a row of a table has another length", name, std::to_string(cells.size()),
                          std::to_string(table.columns.size()));
      table.add(std::move(cells));
    }
    return table;
  } catch (const Json::exception& error) {
    throw usage_error(std::string("not a table: ") + error.what(), name);
  }
}

}  // namespace clerestory
