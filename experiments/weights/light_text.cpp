#include "experiments/weights/light_text.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <sstream>
#include <type_traits>
#include <vector>

#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

/// Names of an enumeration's values, in its order.
const std::vector<std::string>& words_of(LightOutput) {
  static const std::vector<std::string> words{"released", "softplus", "exp", "residual"};
  return words;
}
const std::vector<std::string>& words_of(HyperNet) {
  static const std::vector<std::string> words{"paper", "low_rank"};
  return words;
}

const std::vector<std::string>& words_of(OutOfViewForm) {
  static const std::vector<std::string> words{"field", "shells"};
  return words;
}

const std::vector<std::string>& words_of(DeltaDepth) {
  static const std::vector<std::string> words{name_of(DeltaDepth::Linear), name_of(DeltaDepth::Window)};
  return words;
}

/// Shows every field with its key, numbers with their least and most. A new field is one line, and one name in the
/// binding: without it this does not compile, so that no field is forgotten.
template <class Sizes, class Field>
void each_field(Sizes& sizes, const Field& field) {
  auto& [in_view, out_of_view, delta, li2020] = sizes;
  field("delta", delta, 0, 0);
  if (li2020) {
    auto& [entry, encoder, decoder, lobes] = *li2020;
    field("li2020.entry", entry, kLi2020Group, 4096);
    field("li2020.encoder", encoder, kLi2020Group, 4096);
    field("li2020.decoder", decoder, kLi2020Group, 4096);
    field("li2020.lobes", lobes, 1, 64);
    return;
  }
  const auto trunk_fields = [&](const std::string& part, auto& trunk) {
    auto& [blocks, channels, stages, imagenet_input] = trunk;
    field(part + ".blocks", blocks, 1, 64);
    field(part + ".channels", channels, 1, 4096);
    field(part + ".stages", stages, 0, 4);
    field(part + ".imagenet_input", imagenet_input, 0, 1);
  };
  {
    auto& [trunk, frequencies, direction_deviation, surface_deviation, width, layers, again, output, log_input] =
        in_view;
    trunk_fields("in_view", trunk);
    field("in_view.frequencies", frequencies, 1, 1024);
    field("in_view.direction_deviation", direction_deviation, 0, 1e3);
    field("in_view.surface_deviation", surface_deviation, 0, 1e3);
    field("in_view.width", width, 1, 4096);
    field("in_view.layers", layers, 1, 64);
    field("in_view.again", again, 0, 63);
    field("in_view.output", output, 0, 0);
    field("in_view.log_input", log_input, 0, 1);
  }
  {
    auto& [form, trunk, hyper, stem, inner, rank, octaves, hidden, march, released_output, log_input, sees_maps,
           background, shells, gain] = out_of_view;
    static_cast<void>(gain);  // no shape: it stands beside the text
    auto& [segments, near, radius, jitter] = march;
    auto& [count, first, last, rows, columns, channels, code] = shells;
    field("out_of_view.form", form, 0, 0);
    trunk_fields("out_of_view", trunk);
    field("out_of_view.hyper", hyper, 0, 0);
    field("out_of_view.stem", stem, 1, 65536);
    field("out_of_view.inner", inner, 1, 65536);
    field("out_of_view.rank", rank, 1, 1024);
    field("out_of_view.octaves", octaves, 0, 10);
    field("out_of_view.hidden", hidden, 1, 1024);
    field("out_of_view.segments", segments, 1, 1024);
    field("out_of_view.near", near, 0, 1e3);
    field("out_of_view.radius", radius, 1e-3, 1e3);
    field("out_of_view.jitter", jitter, 0, 1);
    field("out_of_view.released_output", released_output, 0, 1);
    field("out_of_view.log_input", log_input, 0, 1);
    field("out_of_view.sees_maps", sees_maps, 0, 1);
    field("out_of_view.background", background, 0, 1);
    field("out_of_view.shells.count", count, 1, 64);
    field("out_of_view.shells.first", first, 1e-3, 1e3);
    field("out_of_view.shells.last", last, 1e-3, 1e3);
    field("out_of_view.shells.rows", rows, 8, 4096);
    field("out_of_view.shells.columns", columns, 16, 4096);
    field("out_of_view.shells.channels", channels, 16, 4096);
    field("out_of_view.shells.code", code, 1, 65536);
  }
}

template <class T>
std::string text_of(const T& value) {
  if constexpr (std::is_enum_v<T>)
    return words_of(value).at(static_cast<std::size_t>(value));
  else if constexpr (std::is_arithmetic_v<T>)
    return fmt::format("{}", value);
  else
    return fmt::format("{}", fmt::join(value, "-"));
}

/// One value of the text, with what a message about it needs.
struct Given {
  std::string text, where;

  [[noreturn]] void refuse(const std::string& expected) const {
    throw usage_error("the shape of the net makes no sense", where, text, expected);
  }

  void read(bool& to, double, double) const {
    if (text != "true" && text != "false") refuse("true or false");
    to = text == "true";
  }
  void read(double& to, double least, double most) const {
    char* end = nullptr;
    to = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != 0 || !(to >= least && to <= most)) refuse(fmt::format("{} to {}", least, most));
  }
  void read(int& to, double least, double most) const {
    char* end = nullptr;
    const long value = std::strtol(text.c_str(), &end, 10);
    if (text.empty() || *end != 0 || !(static_cast<double>(value) >= least && static_cast<double>(value) <= most))
      refuse(fmt::format("a whole number, {} to {}", least, most));
    to = static_cast<int>(value);
  }
  template <std::size_t N>
  void read(std::array<int, N>& to, double least, double most) const {
    std::vector<int> values;
    read(values, least, most);
    if (values.size() != to.size()) refuse(fmt::format("{} numbers such as {}", N, fmt::join(to, "-")));
    std::ranges::copy(values, to.begin());
  }
  void read(std::vector<int>& to, double least, double most) const {
    to.clear();
    std::stringstream parts(text);
    for (std::string part; std::getline(parts, part, '-');) Given{part, where}.read(to.emplace_back(), least, most);
    if (to.empty() || to.size() > 64) refuse("one to 64 numbers such as 32-32");
  }
  template <class Enum>
  requires std::is_enum_v<Enum>
  void read(Enum& to, double, double) const {
    const std::vector<std::string>& words = words_of(to);
    const auto found = std::ranges::find(words, text);
    if (found == words.end()) refuse(fmt::format("{}", fmt::join(words, ", ")));
    to = static_cast<Enum>(found - words.begin());
  }
};

void check_groups(const Li2020LightSize& size, const std::string& where) {
  const auto check = [&](const auto& channels) {
    if (std::ranges::any_of(channels, [](int n) { return n % kLi2020Group != 0; }))
      throw usage_error("channels do not divide into groups", where + ": net: li2020",
                        fmt::format("{}", fmt::join(channels, "-")), fmt::format("multiples of {}", kLi2020Group));
  };
  check(size.entry), check(size.encoder), check(size.decoder);
}

}  // namespace

std::string light_text(const LightSizes& sizes) {
  std::vector<std::string> pairs;
  each_field(sizes, [&](const std::string& key, const auto& value, double, double) {
    pairs.push_back(key + "=" + text_of(value));
  });
  return fmt::format("{}", fmt::join(pairs, " "));
}

LightSizes light_from_text(const std::string& text, const std::string& where) {
  std::map<std::string, std::string> given;
  std::stringstream pairs(text);
  bool readable = true;
  for (std::string pair; pairs >> pair;) {
    const auto equals = pair.find('=');
    readable = readable && equals != std::string::npos &&
               given.emplace(pair.substr(0, equals), pair.substr(equals + 1)).second;
  }
  if (!readable || given.empty())
    throw usage_error("the shape of the light's nets cannot be read", where + ": net", text,
                      "each key once, as " + light_text(light_sizes("compact")));
  LightSizes sizes;
  if (given.contains("li2020.encoder")) sizes.li2020.emplace();
  each_field(sizes, [&](const std::string& key, auto& value, double least, double most) {
    const auto found = given.find(key);
    if (found == given.end()) return;
    Given{found->second, where + ": net: " + key}.read(value, least, most);
    given.erase(found);
  });
  if (!given.empty())
    throw usage_error("the light's nets have no such field", where + ": net", given.begin()->first,
                      "as " + light_text(sizes));
  if (sizes.li2020) check_groups(*sizes.li2020, where);
  if (sizes.in_view.again >= sizes.in_view.layers)
    throw usage_error("no layer left that is given the input again", where + ": net: in_view.again",
                      fmt::format("{}", sizes.in_view.again), fmt::format("less than {}", sizes.in_view.layers));
  if (sizes.out_of_view.form == OutOfViewForm::Shells && sizes.out_of_view.trunk.stages < 1)
    throw usage_error("painted spheres read two levels of their trunk", where + ": net: out_of_view.stages",
                      fmt::format("{}", sizes.out_of_view.trunk.stages), "1 to 4");
  return sizes;
}

std::map<std::string, Shape> light_states(const LightSizes& sizes) {
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 64, 64), sizes, false)[0];
  ask_light(graph, picture, sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  return states_of(graph);
}

}  // namespace clerestory
