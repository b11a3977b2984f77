#include "experiments/weights/maps_text.hpp"

#include <algorithm>
#include <cstdio>
#include <span>
#include <sstream>

#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"

namespace clerestory {

std::map<std::string, Shape> maps_states(const MgnetSize& net) {
  Graph graph;
  mgnet(graph, graph.input("image", {1, 3, 64, 64}), net, false);
  return states_of(graph);
}

namespace {

constexpr const char* kImagenetInput = "input imagenet";

std::string encoder_text(const DensenetSize& e) {
  const std::string text =
      fmt::format("growth {}, {} first channels, layers {}", e.growth, e.first, fmt::join(e.layers, "-"));
  return e.imagenet_input ? fmt::format("{}, {}", text, kImagenetInput) : text;
}
std::string encoder_text(const Li2020MapsSize& e) { return fmt::format("li2020 {}", fmt::join(e.encoder, "-")); }
std::string encoder_text(const EfficientnetSize& e) {
  return fmt::format("channels {}, layers {}", fmt::join(e.channels, "-"), fmt::join(e.layers, "-"));
}

}  // namespace

std::string net_text(const MgnetSize& net) {
  const std::string encoder = std::visit([](const auto& e) { return encoder_text(e); }, net.encoder);
  return fmt::format("{}, {}decoder {}", encoder, net.shared() ? "shared " : "", fmt::join(net.steps(), "-"));
}

namespace {

/// "6-12-24-16" into a list of that length, each from 1 to `most`; false if it is something else.
bool read_list(const std::string& text, std::span<int> list, int most) {
  std::istringstream in("-" + text);
  char dash = 0;
  for (int& number : list)
    if (!(in >> dash >> number) || dash != '-' || number <= 0 || number > most) return false;
  return in.eof() || in.peek() == std::istringstream::traits_type::eof();
}

bool read_encoder(const std::vector<std::string>& parts, DensenetSize& e) {
  int read = 0;
  e.imagenet_input = parts.size() == 5 && parts[3] == kImagenetInput;
  if (parts.size() != (e.imagenet_input ? 5 : 4) || !parts[2].starts_with("layers ")) return false;
  const auto number = [&](const std::string& text, const char* form, int& value, int most) {
    read = 0;
    return std::sscanf(text.c_str(), form, &value, &read) == 1 && read == static_cast<int>(text.size()) && value > 0 &&
           value <= most;
  };
  return number(parts[0], "growth %d%n", e.growth, 256) && number(parts[1], "%d first channels%n", e.first, 1024) &&
         read_list(parts[2].substr(7), e.layers, 256);
}
bool read_encoder(const std::vector<std::string>& parts, EfficientnetSize& e) {
  return parts.size() == 3 && parts[0].starts_with("channels ") && parts[1].starts_with("layers ") &&
         read_list(parts[0].substr(9), e.channels, 4096) && read_list(parts[1].substr(7), e.layers, 256);
}

bool read_encoder(const std::vector<std::string>& parts, Li2020MapsSize& e) {
  return parts.size() == 2 && parts[0].starts_with("li2020 ") && read_list(parts[0].substr(7), e.encoder, 4096) &&
         std::ranges::all_of(e.encoder, [](int channels) { return channels % kLi2020Group == 0; });
}

/// "decoder 128-64-32-16-16" or "shared decoder ..." into the net's steps; false if it is something else.
bool read_steps(const std::string& text, MgnetSize& net) {
  const std::string name = net.shared() ? "shared decoder " : "decoder ";
  return text.starts_with(name) && read_list(text.substr(name.size()), net.steps(), 4096) && net.steps_wanted().empty();
}

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t at = 0, comma = 0; comma != std::string::npos; at = comma + 2) {
    comma = text.find(", ", at);
    parts.push_back(text.substr(at, comma - at));
  }
  return parts;
}

}  // namespace

MgnetSize net_from_text(const std::string& text, const std::string& where) {
  const bool shared = text.find("shared decoder") != std::string::npos;
  MgnetSize net = mgnet_size(text.starts_with("channels ") ? "lite"
                             : text.starts_with("li2020 ") ? "li2020"
                             : shared                      ? "shared"
                                                           : "compact");
  const std::vector<std::string> parts = parts_of(text);
  const bool sane = std::visit([&](auto& encoder) { return read_encoder(parts, encoder); }, net.encoder) &&
                    read_steps(parts.back(), net);
  if (!sane)
    throw usage_error("the shape of the net makes no sense", where + ": net", text, net_text(mgnet_size("compact")));
  return net;
}

}  // namespace clerestory
