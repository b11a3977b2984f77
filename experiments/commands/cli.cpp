// The command line on top of CLI11.
#include "experiments/commands/cli.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include "host/cl/device.hpp"
#include "host/cl/tile.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

template <class T>
T read_number(const std::string& text, const std::string& option, const char* expected) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size())
    throw usage_error("not " + std::string(expected), option, "'" + text + "'");
  return value;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (char c : text) {
    if (c == separator)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// A command's first run on a device takes longer than the ones after it; this says by how much.
void say_first_builds() {
  constexpr double kWorthALine = 1;  // seconds
  const FirstBuilds built = first_builds();
  if (built.seconds >= kWorthALine)
    say(fmt::format("kernels built for {} in {}", built.device, duration_text(built.seconds)));
}

void print_error(const std::string& text) { std::fprintf(stderr, "clerestory: %s\n", terminal_text(text).c_str()); }

/// "--fov" of "--fov=70"
std::string option_of(const std::string& word) { return word.substr(0, word.find('=')); }

/// Commands, or those of a group; none of a command.
std::vector<std::string> names_in(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

}  // namespace

void read_value(const std::string& text, const std::string&, std::string& to) { to = text; }

void read_value(const std::string& text, const std::string& option, std::filesystem::path& to) {
  if (text.empty()) throw usage_error("a path is empty", option);
  to = text;
}

void read_value(const std::string& text, const std::string& option, int& to) {
  to = read_number<int>(text, option, "an integer");
}

void read_value(const std::string& text, const std::string& option, std::int64_t& to) {
  to = read_number<std::int64_t>(text, option, "an integer");
}

void read_value(const std::string& text, const std::string& option, std::uint64_t& to) {
  to = read_number<std::uint64_t>(text, option, "an integer of at least 0");
}

void read_value(const std::string& text, const std::string& option, double& to) {
  const double value = read_number<double>(text, option, "a number");
  if (!std::isfinite(value)) throw usage_error("not a finite number", option, "'" + text + "'");
  to = value;
}

void read_value(const std::string& text, const std::string& option, bool& to) {
  if (text != "true" && text != "false") throw usage_error("not a flag", option, "'" + text + "'", "true or false");
  to = text == "true";
}

void read_value(const std::string& text, const std::string& option, PixelSize& to) {
  const auto parts = split(text, 'x');
  constexpr int kMost = 65535;
  if (parts.size() != 2) throw usage_error("not a size", option, "'" + text + "'", "WIDTHxHEIGHT");
  const PixelSize size{read_number<int>(parts[0], option, "a width"), read_number<int>(parts[1], option, "a height")};
  if (size.width < 1 || size.height < 1 || size.width > kMost || size.height > kMost)
    throw usage_error("size out of range", option, "'" + text + "'", fmt::format("1 to {} each way", kMost));
  to = size;
}

std::vector<double> read_numbers(const std::string& text, const std::string& option, std::size_t count) {
  std::vector<double> numbers;
  for (const std::string& part : split(text, ',')) {
    numbers.emplace_back();
    read_value(part, option, numbers.back());
  }
  if (numbers.size() != count)
    throw usage_error("wrong number of values", option, "'" + text + "'", fmt::format("{} separated by commas", count));
  return numbers;
}

std::vector<std::string> read_names(const std::string& text, const std::string& option) {
  auto names = split(text, ',');
  if (std::ranges::find(names, "") != names.end())
    throw usage_error("an empty name in a list", option, "'" + text + "'");
  return names;
}

bool was_given(const CommonOptions& common, const std::string& option) {
  return std::ranges::any_of(common.command,
                             [&](const std::string& word) { return word == option || word.starts_with(option + "="); });
}

std::uint32_t render_seed(const CommonOptions& common) {
  constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
  if (common.seed > kMost)
    throw usage_error("out of range", "--seed", fmt::format("{}", common.seed), fmt::format("0 to {}", kMost));
  return static_cast<std::uint32_t>(common.seed);
}

void print_result(const CommonOptions& common, const std::filesystem::path& result, const std::string& json) {
  if (!common.json || !common.json->empty()) std::printf("%s\n", result.c_str());
  write_json_result(common, json);
}

void write_json_result(const CommonOptions& common, const std::string& json) {
  if (!common.json) return;
  if (common.json->empty())
    std::fputs((json + "\n").c_str(), stdout);
  else
    write_file(*common.json, json + "\n");
}

struct Command::State {
  CLI::App* app = nullptr;
  std::map<const CLI::Option*, Take> takes;
  CommonOptions common;
  Action action;

  CLI::Option* add_option(const std::string& names, const std::string& meta, const std::string& doc, Take take) {
    // The values are handed out in their order on the command line after parsing; CLI11 only collects them.
    CLI::Option* option = app->add_option_function<std::vector<std::string>>(
        names, [](const std::vector<std::string>&) {}, doc);
    option->type_name(meta);
    takes[option] = std::move(take);
    return option;
  }

  void add_valued(const std::string& names, const std::string& meta, const std::string& doc, Take take,
                  const std::string& shown_default, CLI::MultiOptionPolicy policy) {
    CLI::Option* option = add_option(names, meta, doc, std::move(take));
    option->expected(1)->multi_option_policy(policy)->allow_extra_args(false);
    if (!shown_default.empty()) option->default_str(shown_default);
  }

  void hand_out() const {
    std::map<const CLI::Option*, std::size_t> handed;
    for (const CLI::Option* option : app->parse_order()) {
      const auto take = takes.find(option);
      const std::vector<std::string> values = option->results();
      const std::size_t at = handed[option]++;
      if (take != takes.end() && at < values.size()) take->second(values[at]);
    }
  }
};

Command& Command::option(const std::string& names, const std::string& meta, const std::string& doc, Take take,
                         const std::string& shown_default) {
  state_->add_valued(names, meta, doc, std::move(take), shown_default, CLI::MultiOptionPolicy::TakeAll);
  return *this;
}

Command& Command::single(const std::string& names, const std::string& meta, const std::string& doc, Take take,
                         const std::string& shown_default) {
  state_->add_valued(names, meta, doc, std::move(take), shown_default, CLI::MultiOptionPolicy::Throw);
  return *this;
}

Command& Command::choice(const std::string& names, const std::string& doc, std::string& to,
                         std::vector<std::string> words) {
  const auto take = [names, words, &to](const std::string& text) {
    if (std::ranges::find(words, text) == words.end())
      throw usage_error("unknown choice", names, "'" + text + "'", joined(words));
    to = text;
  };
  std::string meta;
  for (const std::string& word : words) meta += (meta.empty() ? "" : "|") + word;
  return single(names, meta, doc, take, to);
}

Command& Command::flag(const std::string& names, const std::string& doc, bool& to) {
  state_->app->add_flag(names, to, doc);
  return *this;
}

Command& Command::positional(const std::string& meta, const std::string& doc, Take take, int least, int most) {
  CLI::Option* added = state_->add_option(meta, "", doc, std::move(take));
  added->expected(most == 1 ? 1 : std::max(least, 1), most)->required(least > 0)->allow_extra_args(most > 1);
  return *this;
}

Command& Command::arguments(const std::string& meta, const std::string& doc, std::vector<std::string>& to, int least) {
  return positional(
      meta, doc, [&to](const std::string& text) { to.push_back(text); }, least, CLI::detail::expected_max_vector_size);
}

Command& Command::light(std::vector<std::string> lights, std::filesystem::path& weights, std::string& lamps) {
  state_->common.light = lights.front();
  return choice("--light", "Where the light along a ray comes from (below)", state_->common.light, std::move(lights))
      .option("--method", "NAME|DIR",
              "Whose nets: zhu, li2020, or a folder of weights of maps and light, in place of --weights and "
              "--light-weights; also of which light by default",
              state_->common.method)
      .option("--light-weights", "DIR", "Weights of a learned light: a folder or a file", weights)
      .choice("--lamps", "Lamps out of view, which explain the photograph's shading; auto: under learned light", lamps,
              {"auto", "fit", "none"});
}

Command& Command::common(std::initializer_list<Common> which) {
  CommonOptions& to = state_->common;
  for (Common one : which) {
    switch (one) {
      case Common::Device:
        option("--device", "NAME", "OpenCL device: its number in `clerestory devices`, or part of its name", to.device);
        break;
      case Common::Seed:
        option("--seed", "N", "Seed of everything random", to.seed);
        break;
      case Common::Spp:
        single("--spp", "N", "Samples a pixel; default: 64, of rounds to a goal 16 in the first",
               [&to](const std::string& text) {
                 read_value(text, "--spp", to.spp);
                 if (*to.spp < 1) throw usage_error("too few samples", "--spp", text, "at least 1");
               });
        break;
      case Common::Weights:
        option("--weights", "FILE", "Weights to use (.safetensors)", to.weights);
        break;
      case Common::Preset:
        choice("--preset",
               "paper: takes the weights of the paper's net alone, and says first how much work it is; compact: any",
               to.preset, {"paper", "compact"});
        break;
      case Common::Gemm:
        choice(
            "--gemm",
            "Who multiplies in every net: CLBlast, or our packed kernels, which hold a small net of the light whole; "
            "direct: these without minimal filtering of convolutions; auto: what `clerestory tune` measured faster, "
            "else packed; small nets whole",
            to.gemm, gemm_choices());
        break;
      case Common::Tile:
        choice("--tile", "Register tile of our kernels on a CPU; auto: the fastest, measured once", to.tile,
               tile_choices());
        break;
      case Common::Json:
        // The file takes "=", so that a plain --json does not swallow the argument behind it.
        state_->takes[state_->app->add_flag("--json")->description(
            "Result as JSON on stdout, or into a file with --json=FILE")] = [&to](const std::string& text) {
          to.json = text == "true" ? "" : text;
        };
        break;
      case Common::Quiet:
        flag("--quiet,-q", "No progress, no notes", to.quiet);
        break;
    }
  }
  return *this;
}

Command& Command::notes(const std::string& text) {
  state_->app->footer(text);
  return *this;
}

void Command::run(Action action) { state_->action = std::move(action); }

namespace {

/// Throws when what was printed did not get out: a full disk, a reader that left.
void check_printed() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw Error(ErrorKind::Failed, "the result could not be written", "stdout");
}

}  // namespace

struct CommandLine::State {
  CLI::App app{"Takes a photograph of a room apart into material, geometry and light, and puts it together again",
               "clerestory"};
  std::map<std::string, CLI::App*> groups;
  std::vector<std::shared_ptr<Command::State>> commands;

  CLI::App* group(const std::string& name) {
    CLI::App*& found = groups[name];
    if (!found) found = app.add_subcommand(name)->require_subcommand(1);
    return found;
  }

  /// Throws for a command that does not exist, with the one that was meant: CLI11 says only that one is needed.
  void check_command(const std::vector<std::string>& words) const {
    const CLI::App* at = &app;
    std::string said;
    for (std::size_t i = 1;; ++i) {
      const std::vector<std::string> names = names_in(*at);
      if (names.empty()) return;
      if (i == words.size()) throw usage_error("which command?", said, {}, joined(names));
      const std::string& word = words[i];
      if (word.starts_with("-")) return;
      said += (said.empty() ? "" : " ") + word;
      if (std::ranges::find(names, word) == names.end())
        throw usage_error(fmt::format("there is no such command, did you mean `{}`?", nearest_word(word, names)), said,
                          {}, joined(names));
      at = at->get_subcommand(word);
    }
  }

  /// What CLI11 did not understand, with the command's name and, for an option, the one that was meant.
  std::string explained(const CLI::ParseError& error, const std::vector<std::string>& words) const {
    const CLI::App* command = chosen();
    const std::string name = command == &app ? "" : name_of(*command) + ": ";
    std::vector<std::string> options;
    for (const CLI::Option* known : command->get_options())
      for (const std::string& word : known->get_lnames()) options.push_back("--" + word);
    const auto unknown = std::ranges::find_if(words, [&](const std::string& word) {
      return word.size() > 2 && word.starts_with("--") && std::ranges::find(options, option_of(word)) == options.end();
    });
    if (error.get_exit_code() != static_cast<int>(CLI::ExitCodes::ExtrasError) || unknown == words.end())
      return name + error.what();
    return fmt::format("{}{}: there is no such option, did you mean {}?", name, option_of(*unknown),
                       nearest_word(option_of(*unknown), options));
  }

  /// The parsed command, without one the program itself.
  const CLI::App* chosen() const {
    for (const auto& one : commands)
      if (one->app->parsed()) return one->app;
    return &app;
  }

  /// "data check"
  std::string name_of(const CLI::App& command) const {
    const CLI::App* parent = command.get_parent();
    return (parent == &app ? "" : parent->get_name() + " ") + command.get_name();
  }

  /// Prints what --help or --version asks for. Returns the exit code.
  int tell(const CLI::ParseError& asked) const {
    app.exit(asked);
    try {
      check_printed();
      return 0;
    } catch (const Error& error) {
      print_error(error.what());
      return error.exit_code();
    }
  }

  void run_chosen(std::vector<std::string> command) const {
    for (const auto& one : commands) {
      if (!one->app->parsed()) continue;
      one->hand_out();
      one->common.command = std::move(command);
      set_quiet(one->common.quiet);
      if (one->common.json && !one->common.json->empty()) AtomicFile probe(*one->common.json);  // before the work
      one->action(one->common);
      say_first_builds();
      check_printed();
      return;
    }
  }
};

CommandLine::CommandLine() : state_(std::make_unique<State>()) {
  state_->app.require_subcommand(1);
  state_->app.set_version_flag("--version", this_build().version + " (" + this_build().commit + ")");
  state_->app.footer(
      "Exit codes: 0 done, 1 failed, 2 bad usage, config or input, 3 device trouble, 4 interrupted (can resume).");
}

CommandLine::~CommandLine() = default;

void CommandLine::describe_group(const std::string& name, const std::string& doc) {
  state_->group(name)->description(doc);
}

Command CommandLine::add(const std::string& name, const std::string& doc) {
  const auto space = name.find(' ');
  CLI::App* parent = space == std::string::npos ? &state_->app : state_->group(name.substr(0, space));
  auto command = std::make_shared<Command::State>();
  command->app = parent->add_subcommand(space == std::string::npos ? name : name.substr(space + 1), doc);
  command->action = [name](const CommonOptions&) { throw Error(ErrorKind::Failed, "command without an action", name); };
  state_->commands.push_back(command);
  return Command(command);
}

int CommandLine::run(int argc, const char* const* argv) {
  const std::vector<std::string> words(argv, argv + argc);
  try {
    state_->check_command(words);
    state_->app.parse(argc, argv);
    state_->run_chosen(words);
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return state_->tell(error);
    print_error(state_->explained(error, words));
    const CLI::App* command = state_->chosen();
    std::fprintf(stderr, "`clerestory %s%s--help` says what there is.\n",
                 command == &state_->app ? "" : state_->name_of(*command).c_str(), command == &state_->app ? "" : " ");
    return static_cast<int>(ErrorKind::Usage);
  } catch (const Error& error) {
    print_error(error.what());
    return error.exit_code();
  } catch (const std::bad_alloc&) {
    std::fputs("clerestory: out of memory\n", stderr);
    return static_cast<int>(ErrorKind::Failed);
  } catch (const std::filesystem::filesystem_error& error) {
    // A name that leads nowhere is the user's, a broken disk is not.
    const bool named = error.code() == std::errc::permission_denied || error.code() == std::errc::filename_too_long ||
                       error.code() == std::errc::too_many_symbolic_link_levels;
    print_error(named ? usage_error(error.code().message(), error.path1().string()).what() : error.what());
    return static_cast<int>(named ? ErrorKind::Usage : ErrorKind::Failed);
  } catch (const std::system_error& error) {
    const bool thread = error.code() == std::errc::resource_unavailable_try_again;
    print_error(thread ? "no thread can be started: memory or processes are short (ulimit -v, ulimit -u)"
                       : error.what());
    return static_cast<int>(ErrorKind::Failed);
  } catch (const std::exception& error) {
    print_error(error.what());
    return static_cast<int>(ErrorKind::Failed);
  }
}

}  // namespace clerestory
