// The command line: sub-commands, their options, exit codes. CLI11 stays behind it.
//
//   void add_devices_command(CommandLine& line) {
//     auto options = std::make_shared<Options>();
//     line.add("devices", "Lists the OpenCL devices")
//         .common({Common::Json})
//         .run([](const CommonOptions& common) { ... });
//   }
//
// Targets of options must live as long as the command line: keep them in a shared_ptr that the action holds.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/error.hpp"

namespace clerestory {

/// Options that mean the same wherever they occur. A command takes those that do something for it.
enum class Common { Device, Seed, Spp, Weights, Preset, Gemm, Tile, Json, Quiet };

struct CommonOptions {
  std::string device;                // --device; empty: CLERESTORY_DEVICE, else the first sound one
  std::uint64_t seed = 0;            // --seed
  std::optional<std::int64_t> spp;   // --spp, at least 1
  std::filesystem::path weights;     // --weights; empty: the shipped ones
  std::string preset = "compact";    // --preset paper|compact
  std::string light;                 // --light, of the command's own choices (Command::light)
  std::string method;                // --method (Command::light); empty: not named
  std::string gemm = "auto";         // --gemm clblast|packed|auto
  std::string tile = "auto";         // --tile, of host/cl/tile.hpp
  std::optional<std::string> json;   // --json: empty for stdout, else a file
  bool quiet = false;                // --quiet; set_quiet has been called
  std::vector<std::string> command;  // argv, for provenance
};

/// Whether the option ("--seed") stands on the command line.
bool was_given(const CommonOptions& common, const std::string& option);

/// --seed of a render, which counts in 32 bits. Throws usage_error on a larger one.
std::uint32_t render_seed(const CommonOptions& common);

/// Writes a command's JSON result where --json says.
void write_json_result(const CommonOptions& common, const std::string& json);
/// The same, and `result`, where it lies, alone on a line of stdout, unless that is JSON.
void print_result(const CommonOptions& common, const std::filesystem::path& result, const std::string& json);

/// Texts to values; throw usage_error naming the option.
void read_value(const std::string& text, const std::string& option, std::string& to);
void read_value(const std::string& text, const std::string& option, std::filesystem::path& to);
void read_value(const std::string& text, const std::string& option, int& to);
void read_value(const std::string& text, const std::string& option, std::int64_t& to);
void read_value(const std::string& text, const std::string& option, std::uint64_t& to);
void read_value(const std::string& text, const std::string& option, double& to);  // finite
void read_value(const std::string& text, const std::string& option, bool& to);    // true or false
/// Comma-separated: "1,2.5" has two numbers.
std::vector<double> read_numbers(const std::string& text, const std::string& option, std::size_t count);
std::vector<std::string> read_names(const std::string& text, const std::string& option);

/// "640x480".
struct PixelSize {
  int width = 0, height = 0;
};
void read_value(const std::string& text, const std::string& option, PixelSize& to);  // 1 to 65535 each

template <class T>
void read_value(const std::string& text, const std::string& option, std::optional<T>& to) {
  T value{};
  read_value(text, option, value);
  to = std::move(value);
}

/// A default for --help; nothing for what is not set.
inline std::string shown(const std::string& value) { return value; }
inline std::string shown(const std::filesystem::path& value) { return value.string(); }
inline std::string shown(const PixelSize& size) {
  return size.width > 0 ? fmt::format("{}x{}", size.width, size.height) : std::string();
}
template <class T>
requires std::is_arithmetic_v<T> std::string shown(T value) { return fmt::format("{}", value); }
template <class T>
std::string shown(const std::optional<T>& value) {
  return value ? shown(*value) : std::string();
}

/// One sub-command.
class Command {
 public:
  using Take = std::function<void(const std::string&)>;
  using Action = std::function<void(const CommonOptions&)>;

  /// `--name VALUE`. `take` is called once for every occurrence, all options in the order of the command line, so that
  /// `insert --at 1,2 --radius 1 --at 3,4` can tell which radius belongs to which ball. `shown_default` is for --help.
  Command& option(const std::string& names, const std::string& meta, const std::string& doc, Take take,
                  const std::string& shown_default = {});
  /// `--name VALUE` into a variable: text, path, number, PixelSize, or an optional of these. Twice is an error.
  template <class T>
  Command& option(const std::string& names, const std::string& meta, const std::string& doc, T& to) {
    return single(
        names, meta, doc, [names, &to](const std::string& text) { read_value(text, names, to); }, shown(to));
  }
  /// One of a few words.
  Command& choice(const std::string& names, const std::string& doc, std::string& to, std::vector<std::string> words);
  Command& flag(const std::string& names, const std::string& doc, bool& to);
  /// A required argument without a name.
  template <class T>
  Command& argument(const std::string& meta, const std::string& doc, T& to) {
    return positional(
        meta, doc, [meta, &to](const std::string& text) { read_value(text, meta, to); }, 1, 1);
  }
  template <class T>
  Command& optional_argument(const std::string& meta, const std::string& doc, T& to) {
    return positional(
        meta, doc, [meta, &to](const std::string& text) { read_value(text, meta, to); }, 0, 1);
  }
  /// Any number of arguments, at least `least`: config overrides, families of benchmarks.
  Command& arguments(const std::string& meta, const std::string& doc, std::vector<std::string>& to, int least = 0);

  Command& common(std::initializer_list<Common> which);
  /// --light with the lights that this command can use, the first of them by default; --method, --light-weights,
  /// --lamps.
  Command& light(std::vector<std::string> lights, std::filesystem::path& weights, std::string& lamps);
  /// Printed below the options by --help: examples, units.
  Command& notes(const std::string& text);
  void run(Action action);

 private:
  friend class CommandLine;
  struct State;
  explicit Command(std::shared_ptr<State> state) : state_(std::move(state)) {}
  Command& single(const std::string& names, const std::string& meta, const std::string& doc, Take take,
                  const std::string& shown_default = {});
  Command& positional(const std::string& meta, const std::string& doc, Take take, int least, int most);
  std::shared_ptr<State> state_;
};

class CommandLine {
 public:
  CommandLine();
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// A name of two words ("weights import") makes a command within a group; `doc` describes the command. Refer to the
  /// result only while setting it up.
  Command add(const std::string& name, const std::string& doc);
  /// One line about a group of commands ("weights").
  void describe_group(const std::string& name, const std::string& doc);

  /// Parses, runs the chosen command, says what went wrong as "clerestory: ..." on stderr. The exit code: 0 done,
  /// 1 failed, 2 bad usage, config or input, 3 device trouble, 4 interrupted.
  int run(int argc, const char* const* argv);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clerestory
