#include "experiments/commands/verdict_tables.hpp"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "host/io/files.hpp"
#include "host/report/html.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Right, wrong or refused, and what that goes by.
std::string state_of(const Json& verdict) {
  return verdict.at("state").get<std::string>() + (verdict.value("quick", false) ? ", smallest cases alone" : "") +
         (verdict.value("kept", false) ? ", as checked before" : "");
}

/// The largest of a column, with the kernel that has it.
std::pair<double, std::string> worst_of(const Json& verdict, const char* column) {
  std::pair<double, std::string> worst{NAN, ""};
  for (const Json& kernel : verdict.at("kernels")) {
    if (!kernel.at(column).is_number() || !kernel.at("faults").empty()) continue;
    const double ulps = kernel.at(column);
    if (!(ulps <= worst.first)) worst = {ulps, kernel.at("kernel")};
  }
  return worst;
}

}  // namespace

Totals totals_of(const Json& all) {
  Totals t;
  for (const Json& verdict : all.at("devices")) {
    ++t.devices;
    for (const Json& kernel : verdict.at("kernels")) t.kernels.insert(kernel.at("kernel"));
    for (const Json& failure : verdict.at("failures")) ++t.failed, t.unexplained += failure.at("explained").is_null();
    if (verdict.at("state") == "wrong") t.at_fault.push_back(verdict.at("device").at("name"));
    t.refused += verdict.at("state") == "refused";
  }
  return t;
}

std::string totals_text(const Totals& t) {
  return fmt::format("kernels {} devices {} failed {} unexplained {}\n", t.kernels.size(), t.devices, t.failed,
                     t.unexplained);
}

std::string label_of(const Json& verdict) {
  const Json& device = verdict.at("device");
  std::string label =
      fmt::format("{} ({})", device.at("name").get<std::string>(), device.at("platform").get<std::string>());
  for (const char* with : {"less", "told"})
    if (const std::string what = device.value(with, ""); !what.empty()) label += " with " + what;
  return label;
}

Table devices_table(const Json& all) {
  Table table;
  table.title = "Devices";
  table.note =
      "Errors of float in epsilons (1.2e-7) of the largest number of an output: of values from a reference in plain "
      "C++ "
      "and from the same kernel in double, of gradients from those in double; the worst of all kernels that are right.";
  for (const char* name : {"device", "driver", "state", "kernels", "in double"}) table.columns.push_back({name});
  for (const char* name : {"worst value", "worst gradient"}) table.columns.push_back({name, "epsilon"});
  for (const char* name : {"failed", "explained"}) table.columns.push_back({name});
  for (const Json& verdict : all.at("devices")) {
    long doubles = 0, explained = 0;
    for (const Json& kernel : verdict.at("kernels")) doubles += kernel.at("in_double").get<bool>();
    for (const Json& failure : verdict.at("failures")) explained += !failure.at("explained").is_null();
    const auto worst = [&](const char* column) {
      const double ulps = worst_of(verdict, column).first;
      return std::isnan(ulps) ? Cell() : Cell(Measure{ulps});
    };
    table.add({label_of(verdict), verdict.at("device").at("driver").get<std::string>(), state_of(verdict),
               fmt::format("{}", verdict.at("kernels").size()), fmt::format("{}", doubles), worst("value_ulps"),
               worst("gradient_ulps"), fmt::format("{}", verdict.at("failures").size()), fmt::format("{}", explained)});
  }
  return table;
}

Table kernels_table(const Json& all) {
  Table table;
  table.title = "Kernels";
  table.note = "Of each device: error of the value / of the gradient in epsilons; - : nothing to compare.";
  table.columns.push_back({"kernel and defines"});
  std::map<std::string, std::vector<Cell>> rows;
  std::size_t column = 0;
  for (const Json& verdict : all.at("devices")) {
    if (verdict.at("kernels").empty()) continue;
    table.columns.push_back({label_of(verdict), "epsilon"});
    ++column;
    for (const Json& kernel : verdict.at("kernels")) {
      std::vector<Cell>& row = rows[kernel.at("kernel")];
      row.resize(column);
      const auto text = [](const Json& ulps) {
        return ulps.is_number() ? fmt::format("{:.3g}", ulps.get<double>()) : "-";
      };
      row.back() = kernel.at("faults").empty()
                       ? fmt::format("{} / {}", text(kernel.at("value_ulps")), text(kernel.at("gradient_ulps")))
                       : std::string("FAULT");
    }
  }
  for (auto& [kernel, row] : rows) {
    row.resize(column);
    row.insert(row.begin(), kernel);
    table.add(row);
  }
  return table;
}

Table failures_table(const Json& all) {
  Table table;
  table.title = "What failed";
  for (const char* name : {"device", "kernel", "fault", "shown by"}) table.columns.push_back({name});
  for (const Json& verdict : all.at("devices"))
    for (const Json& failure : verdict.at("failures"))
      table.add({label_of(verdict), failure.at("kernel").get<std::string>(), failure.at("fault").get<std::string>(),
                 failure.at("explained").is_null()
                     ? Cell("nothing: unexplained")
                     : Cell("checks/reproducers/" + failure.at("explained").get<std::string>())});
  return table;
}

namespace {

std::string markdown_of(const Json& all) {
  const Table failures = failures_table(all);
  return fmt::format(
      "# Devices\n\nWhat `clerestory check --device all` found on drivers that can be had without their hardware, "
      "written by\nits `--report` (`tests/devices.sh` sets drivers up). The last line: kernel variants, devices, "
      "failures "
      "(pairs of both, or a\ndevice refused), and those that no [reproducer](../checks/reproducers) shows.\n\n"
      "{}\n{}{}\n{}",
      table_markdown(devices_table(all)), failures.rows.empty() ? "" : table_markdown(failures) + "\n",
      table_markdown(kernels_table(all)), totals_text(totals_of(all)));
}

}  // namespace

void expect_report_name(const fs::path& file) {
  if (!file.empty() && file.extension() != ".md" && file.extension() != ".html")
    throw usage_error("neither a page nor Markdown", "--report", file.string(), "FILE.html or FILE.md");
  if (!file.empty()) AtomicFile tried(file);  // hours go by before it is written
}

void write_report(const fs::path& file, const Json& all, const CommonOptions& common) {
  if (file.extension() == ".md") return write_file(file, markdown_of(all));
  HtmlReport page("Kernels on devices", totals_text(totals_of(all)));
  page.section("Devices").table(devices_table(all));
  if (const Table failures = failures_table(all); !failures.rows.empty()) page.section("What failed").table(failures);
  page.section("Kernels").table(kernels_table(all));
  page.footer(begin_provenance(common.command)).write(file);
}

}  // namespace clerestory
