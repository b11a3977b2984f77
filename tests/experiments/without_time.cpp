#include "tests/experiments/without_time.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "host/io/safetensors.hpp"
#include "tests/experiments/program.hpp"

namespace clerestory {
namespace {

using nlohmann::json;

void drop_clocks(json& value) {
  if (value.is_object())
    for (const char* key : {"seconds", "started", "ended", "hours", "views_per_second", "time/views_per_second"})
      value.erase(key);
  // outputs of provenance.json: weights, whose metadata hold the hours
  if (value.is_object() && value.contains("hash")) value.erase("hash"), value.erase("bytes");
  if (value.is_structured())
    for (json& inner : value) drop_clocks(inner);
}

std::string json_without_time(const std::string& text) {
  json value = json::parse(text);
  drop_clocks(value);
  return value.dump(1);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string tensors_without_time(const std::filesystem::path& path) {
  TensorFile file = read_safetensors(path);
  if (const auto progress = file.tensors.find("training.progress"); progress != file.tensors.end())
    std::get<std::vector<std::uint64_t>>(progress->second.values).at(1) = 0;  // the seconds
  file.metadata.erase("hours");
  std::string out;
  for (const auto& [key, value] : file.metadata)
    out += fmt::format("{} = {}\n", key, key == "history" ? json_without_time(value) : value);
  for (const auto& [name, tensor] : file.tensors) {
    out += name;
    out += fmt::format(" {}", fmt::join(tensor.shape, "x"));
    std::visit(
        [&](const auto& values) {
          out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
        },
        tensor.values);
  }
  return out;
}

/// The lines "<date> step N: ...", without the date.
std::string steps_of_log(const std::string& text) {
  std::set<std::string> steps;
  for (const std::string& line : lines_of(text)) {
    const std::size_t said = line.find(' ') + 1;
    if (line.compare(said, 5, "step ") == 0) steps.insert(line.substr(said));
  }
  std::string out;
  for (const std::string& line : steps) out += line + "\n";
  return out;
}

std::string card_without_time(const std::string& text) {
  std::string out;
  for (const std::string& line : lines_of(text))
    if (!line.starts_with("| hash") && !line.starts_with("| size") && !line.starts_with("| training |") &&
        !line.starts_with("| 1 |"))
      out += line + "\n";
  return out;
}

/// Without the parts that begin with `first`, end with the next `last` and hold `mark`.
std::string without_parts(const std::string& text, const std::string& first, const std::string& last,
                          const std::string& mark) {
  std::string out;
  std::size_t at = 0;
  for (std::size_t begin; (begin = text.find(first, at)) != std::string::npos;) {
    const std::size_t end = text.find(last, begin);
    const std::string part = text.substr(begin, end - begin);
    out += text.substr(at, begin - at);
    if (part.find(mark) == std::string::npos) out += part;
    at = end;
    if (end == std::string::npos) return out;
  }
  return out + text.substr(at);
}

std::string report_without_time(const std::string& html) {
  std::string out = without_parts(html, "<figure class=\"plot\">", "</figure>", "hours of training");
  for (const char* fact : {"<dt>time</dt>", "<dt>speed</dt>"}) out = without_parts(out, fact, "</div>", "");
  return without_parts(out, "<footer", "</footer>", "");  // provenance, which is a file of its own
}

}  // namespace

std::map<std::string, std::string> without_time(const std::filesystem::path& run) {
  std::map<std::string, std::string> files;
  for (const std::string& name : files_below(run)) {
    const std::string text = text_of(run / name);
    std::string& out = files[name];
    if (name.ends_with(".safetensors"))
      out = tensors_without_time(run / name);
    else if (name.ends_with(".jsonl"))
      for (const std::string& line : lines_of(text)) out += json_without_time(line) + "\n";
    else if (name.ends_with("provenance.json"))
      out = json_without_time(text);
    else if (name == "log.txt")
      out = steps_of_log(text);
    else if (name.ends_with(".md"))
      out = card_without_time(text);
    else if (name == "report.html")
      out = report_without_time(text);
    else if (name == "DONE" || name.ends_with(".svg"))
      out = text.empty() ? "empty" : "there";
    else
      out = text;
  }
  return files;
}

}  // namespace clerestory
