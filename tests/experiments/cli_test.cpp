// The command line: values, order, exit codes, messages.
#include "experiments/commands/cli.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/report/in_child.hpp"

namespace clerestory {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Outcome {
  int code = -1;
  std::string out, errors;
};

Outcome run(CommandLine& line, std::vector<std::string> words) {
  words.insert(words.begin(), "clerestory");
  std::vector<const char*> argv;
  for (const std::string& word : words) argv.push_back(word.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Outcome outcome;
  outcome.code = line.run(static_cast<int>(argv.size()), argv.data());
  std::fflush(stdout);
  outcome.out = testing::internal::GetCapturedStdout();
  outcome.errors = testing::internal::GetCapturedStderr();
  return outcome;
}

/// A command with one option of every kind; remembers what it was given.
struct Probe {
  std::filesystem::path photo, light_weights;
  std::vector<std::string> rest;
  std::optional<double> fov;
  PixelSize size{64, 48};
  int views = 7;
  bool balls = false;
  std::vector<std::string> order;
  std::string maps = "predicted", lamps = "auto";
  CommonOptions common;
  int runs = 0;

  void add_to(CommandLine& line, const std::string& name = "probe") {
    const auto ordered = [this](const std::string& option) {
      return [this, option](const std::string& value) { order.push_back(option + "=" + value); };
    };
    line.add(name, "Tests the command line")
        .argument("PHOTO", "A photograph", photo)
        .arguments("OVERRIDES", "Overrides", rest)
        .option("--fov", "DEG", "Field of view", fov)
        .option("--size", "WxH", "Size of views", size)
        .option("--views", "N", "Views", views)
        .flag("--balls", "With balls", balls)
        .option("--at", "X,Y", "Place", ordered("at"))
        .option("--radius", "M", "Radius", ordered("radius"))
        .choice("--maps", "Which maps", maps, {"truth", "predicted"})
        .common({Common::Device, Common::Seed, Common::Spp, Common::Weights, Common::Preset, Common::Gemm, Common::Tile,
                 Common::Json, Common::Quiet})
        .light({"image", "constant"}, light_weights, lamps)
        .notes("A note at the end.")
        .run([this](const CommonOptions& given) {
          common = given;
          ++runs;
        });
  }
};

TEST(CommandLine, DefaultsReachTheAction) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  const Outcome outcome = run(line, {"probe", "a.png"});
  EXPECT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(probe.runs, 1);
  EXPECT_EQ(probe.photo, "a.png");
  EXPECT_FALSE(probe.fov.has_value());
  EXPECT_EQ(probe.size.width, 64);
  EXPECT_EQ(probe.common.light, "image");
  EXPECT_EQ(probe.common.preset, "compact");
  EXPECT_EQ(probe.common.gemm, "auto");
  EXPECT_EQ(probe.common.tile, "auto");
  EXPECT_FALSE(probe.common.spp.has_value());
  EXPECT_FALSE(probe.common.json.has_value());
  EXPECT_EQ(probe.common.command, (std::vector<std::string>{"clerestory", "probe", "a.png"}));
}

TEST(CommandLine, EveryKindOfValue) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  const Outcome outcome = run(line, {"probe",
                                     "--fov",
                                     "62.5",
                                     "--size=320x240",
                                     "a.png",
                                     "model.width=3",
                                     "~x.y",
                                     "+a.b=-1",
                                     "--balls",
                                     "--views",
                                     "12",
                                     "--maps",
                                     "truth",
                                     "--device",
                                     "PoCL",
                                     "--seed",
                                     "18446744073709551615",
                                     "--spp",
                                     "4",
                                     "--weights",
                                     "w.safetensors",
                                     "--preset",
                                     "paper",
                                     "--light",
                                     "constant",
                                     "--gemm",
                                     "packed",
                                     "--tile",
                                     "4x24",
                                     "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(probe.fov, 62.5);
  EXPECT_EQ(probe.size.width, 320);
  EXPECT_EQ(probe.size.height, 240);
  EXPECT_EQ(probe.photo, "a.png");
  EXPECT_EQ(probe.rest, (std::vector<std::string>{"model.width=3", "~x.y", "+a.b=-1"}));
  EXPECT_TRUE(probe.balls);
  EXPECT_EQ(probe.views, 12);
  EXPECT_EQ(probe.maps, "truth");
  EXPECT_EQ(probe.common.device, "PoCL");
  EXPECT_EQ(probe.common.seed, 18446744073709551615u);
  EXPECT_EQ(probe.common.spp, 4);
  EXPECT_EQ(probe.common.weights, "w.safetensors");
  EXPECT_EQ(probe.common.preset, "paper");
  EXPECT_EQ(probe.common.light, "constant");
  EXPECT_EQ(probe.common.gemm, "packed");
  EXPECT_EQ(probe.common.tile, "4x24");
  EXPECT_TRUE(probe.common.quiet);
}

TEST(CommandLine, ATileThatDoesNotExistIsRefusedWithTheList) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  const Outcome outcome = run(line, {"probe", "a.png", "--tile", "6x16"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(probe.runs, 0);
  EXPECT_THAT(outcome.errors, HasSubstr("--tile"));
  EXPECT_THAT(outcome.errors, HasSubstr("6x16"));
  EXPECT_THAT(outcome.errors, HasSubstr("auto, 8x48, 8x24, 4x24, 8x12, 4x12"));
}

TEST(CommandLine, RepeatedOptionsKeepTheirOrder) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  const Outcome outcome =
      run(line, {"probe", "a.png", "--at", "1,2", "--radius", "0.5", "--at", "-3,4", "--at=5,6", "--radius", "0.25"});
  ASSERT_EQ(outcome.code, 0) << outcome.errors;
  EXPECT_EQ(probe.order, (std::vector<std::string>{"at=1,2", "radius=0.5", "at=-3,4", "at=5,6", "radius=0.25"}));
}

TEST(CommandLine, JsonGoesToStdoutOrAFile) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  EXPECT_EQ(run(line, {"probe", "--json", "a.png"}).code, 0);
  EXPECT_EQ(probe.common.json, "") << "a plain --json must not swallow what follows";
  EXPECT_EQ(probe.photo, "a.png");
  const auto path = std::filesystem::temp_directory_path() / ("cli_test_" + std::to_string(getpid()) + ".json");
  CommandLine second;
  Probe other;
  other.add_to(second);
  EXPECT_EQ(run(second, {"probe", "a.png", "--json=" + path.string()}).code, 0);
  EXPECT_EQ(other.common.json, path.string());
  write_json_result(other.common, "{}");
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  EXPECT_EQ(text.str(), "{}\n");
  std::filesystem::remove(path);
}

TEST(CommandLine, BadUsageIsTwo) {
  const std::vector<std::vector<std::string>> bad = {
      {},
      {"no-such-command"},
      {"probe"},
      {"probe", "a.png", "--no-such-option"},
      {"probe", "a.png", "--fov"},
      {"probe", "a.png", "--fov", "wide"},
      {"probe", "a.png", "--fov", "nan"},
      {"probe", "a.png", "--fov", "inf"},
      {"probe", "a.png", "--fov", "1", "--fov", "2"},
      {"probe", "a.png", "--size", "0x10"},
      {"probe", "a.png", "--size", "-4x10"},
      {"probe", "a.png", "--size", "10"},
      {"probe", "a.png", "--size", "10x99999999999"},
      {"probe", "a.png", "--views", "1.5"},
      {"probe", "a.png", "--seed", "-1"},
      {"probe", "a.png", "--spp", "0"},
      {"probe", "a.png", "--preset", "huge"},
      {"probe", "a.png", "--light", "truth"},
      {"probe", ""},
  };
  for (const auto& words : bad) {
    CommandLine line;
    Probe probe;
    probe.add_to(line);
    const Outcome outcome = run(line, words);
    EXPECT_EQ(outcome.code, 2) << testing::PrintToString(words);
    EXPECT_EQ(probe.runs, 0);
    EXPECT_THAT(outcome.errors, HasSubstr("clerestory: ")) << testing::PrintToString(words);
    EXPECT_EQ(outcome.out, "");
  }
}

TEST(CommandLine, MessagesNameTheOptionAndTheChoices) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  EXPECT_THAT(run(line, {"probe", "a.png", "--light", "truth"}).errors,
              HasSubstr("--light: unknown choice (found 'truth', expected image, constant)"));
}

TEST(CommandLine, WhatIsMisspeltIsNamedWithWhatWasMeant) {
  const auto errors_of = [](const std::vector<std::string>& words) {
    CommandLine line;
    Probe probe, other;
    probe.add_to(line);
    other.add_to(line, "group act");
    return run(line, words).errors;
  };
  EXPECT_THAT(errors_of({"prob", "a.png"}), HasSubstr("prob: there is no such command, did you mean `probe`?"));
  EXPECT_THAT(errors_of({"group", "axt", "a.png"}),
              HasSubstr("group axt: there is no such command, did you mean `act`?"));
  EXPECT_THAT(errors_of({}), HasSubstr("which command? (expected probe, group)"));
  EXPECT_THAT(errors_of({"group"}), HasSubstr("group: which command? (expected act)"));
  EXPECT_THAT(errors_of({"probe", "a.png", "--fv", "70"}),
              HasSubstr("probe: --fv: there is no such option, did you mean --fov?"));
  EXPECT_THAT(errors_of({"probe", "a.png", "--seed", "1", "--sise=3x4"}),
              HasSubstr("--sise: there is no such option, did you mean --size?"));
  EXPECT_THAT(errors_of({"group", "act"}),
              AllOf(HasSubstr("group act: PHOTO is required"), HasSubstr("`clerestory group act --help`")));
}

TEST(CommandLine, HelpIsZeroAndShowsWhatIsThere) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"--help"}, {"probe", "--help"}, {"--version"}}) {
    const Outcome outcome = run(line, words);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.out, "");
    EXPECT_EQ(outcome.errors, "");
  }
  EXPECT_EQ(probe.runs, 0);
  const std::string help = run(line, {"probe", "--help"}).out;
  for (const char* part :
       {"PHOTO", "--fov", "64x48", "truth|predicted", "image|constant", "--spp", "A note at the end."})
    EXPECT_THAT(help, HasSubstr(part));
  EXPECT_THAT(run(line, {"--help"}).out, HasSubstr("Tests the command line"));
}

TEST(CommandLine, ErrorsBecomeExitCodes) {
  const auto code_of = [](const std::function<void()>& action) {
    CommandLine line;
    line.add("act", "Acts").run([&](const CommonOptions&) { action(); });
    const Outcome outcome = run(line, {"act"});
    EXPECT_THAT(outcome.errors, HasSubstr("clerestory: "));
    return outcome.code;
  };
  EXPECT_EQ(code_of([] { throw Error(ErrorKind::Failed, "disk full"); }), 1);
  EXPECT_EQ(code_of([] { throw usage_error("bad"); }), 2);
  EXPECT_EQ(code_of([] { throw Error(ErrorKind::Device, "none"); }), 3);
  EXPECT_EQ(code_of([] { throw Error(ErrorKind::Interrupted, "stopped"); }), 4);
  EXPECT_EQ(code_of([] { throw std::runtime_error("other"); }), 1);
  EXPECT_EQ(code_of([] { throw std::bad_alloc(); }), 1);
}

// A file's name may hold what would move the cursor or rename the window.
TEST(CommandLine, ErrorsDoNotSpeakToTheTerminal) {
  const std::string name = "photo\x1b[2J\x07.png";
  for (const auto& action : std::vector<std::function<void()>>{
           [&] { throw usage_error("cannot be opened", name, name); }, [&] { throw std::runtime_error(name); }}) {
    CommandLine line;
    line.add("act", "Acts").run([&](const CommonOptions&) { action(); });
    const Outcome outcome = run(line, {"act"});
    EXPECT_THAT(outcome.errors, HasSubstr("photo\\x1b[2J\\x07.png"));
    EXPECT_THAT(outcome.errors, Not(HasSubstr("\x1b")));
    EXPECT_THAT(run(line, {name}).errors, Not(HasSubstr("\x1b")));
  }
}

TEST(CommandLine, AResultThatCannotBeWrittenIsRefusedBeforeTheWork) {
  CommandLine line;
  Probe probe;
  probe.add_to(line);
  const Outcome outcome = run(line, {"probe", "a.png", "--json=/nonexistent/result.json"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.errors, HasSubstr("/nonexistent/result.json"));
  EXPECT_EQ(probe.runs, 0);
}

TEST(CommandLine, AThreadThatCannotBeStartedSaysWhatIsShort) {
  CommandLine line;
  line.add("fork", "Starts a thread").run([](const CommonOptions&) {
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
  });
  const Outcome outcome = run(line, {"fork"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.errors, HasSubstr("ulimit -v"));
}

TEST(CommandLine, AVersionThatWasLostOnItsWayIsAFailure) {
  EXPECT_EQ(in_child([&] {
              CommandLine line;
              const char* words[] = {"clerestory", "--version"};
              return std::freopen("/dev/full", "w", stdout) == nullptr ? 9 : line.run(2, words);
            }),
            1);
}

TEST(CommandLine, AResultThatWasLostOnItsWayIsAFailure) {
  for (const std::size_t bytes : {10u, 100000u})
    EXPECT_EQ(in_child([&] {
                CommandLine line;
                line.add("tell", "Prints").run([&](const CommonOptions&) {
                  std::fputs(std::string(bytes, '.').c_str(), stdout);
                });
                const char* words[] = {"clerestory", "tell"};
                return std::freopen("/dev/full", "w", stdout) == nullptr ? 9 : line.run(2, words);
              }),
              1);
}

TEST(CommandLine, GroupsOfCommands) {
  CommandLine line;
  std::string file, chosen;
  line.describe_group("weights", "Weights in other formats");
  line.add("weights import", "Reads").argument("FILE", "A file", file).run([&](const CommonOptions&) {
    chosen = "import";
  });
  line.add("weights export", "Writes").argument("FILE", "A file", file).run([&](const CommonOptions&) {
    chosen = "export";
  });
  EXPECT_EQ(run(line, {"weights", "export", "x.pth"}).code, 0);
  EXPECT_EQ(chosen, "export");
  EXPECT_EQ(file, "x.pth");
  EXPECT_EQ(run(line, {"weights"}).code, 2);
  EXPECT_THAT(run(line, {"--help"}).out, HasSubstr("Weights in other formats"));
}

TEST(CommandLine, ListsOfNumbersAndNames) {
  EXPECT_EQ(read_numbers("1,-2.5,3e-1", "--at", 3), (std::vector<double>{1, -2.5, 0.3}));
  EXPECT_THROW(read_numbers("1,2", "--at", 3), Error);
  EXPECT_THROW(read_numbers("1,,2", "--at", 3), Error);
  EXPECT_THROW(read_numbers("1,nan", "--at", 2), Error);
  EXPECT_EQ(read_names("albedo,normal", "--only"), (std::vector<std::string>{"albedo", "normal"}));
  EXPECT_THROW(read_names("albedo,", "--only"), Error);
}

}  // namespace
}  // namespace clerestory
