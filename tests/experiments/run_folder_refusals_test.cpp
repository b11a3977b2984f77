// Mistakes are refused before the work: impossible outputs, missing pieces, options that do not do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/applications/run_folder.hpp"
#include "tests/experiments/run_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST_F(RunFolder, AnImpossibleOutputIsRefusedBeforeTheDeviceIsAsked) {
  put(folder_ / "file", "");
  fs::create_directories(folder_ / "probe.exr");
  const fs::path below = folder_ / "file" / "below";
  const auto refused = [&](Words words, const std::string& named) {
    words.insert(words.end(), {"--device", "there is no such device"});
    expect_refused(words, named);
    EXPECT_THAT(said(), Not(HasSubstr("no such device")));
  };
  refused(inserted({"--out", below}), "file");
  refused(edited({"--out", below}), "file");
  refused(lit({"--out", below / "probe.exr"}), "file");
  refused(lit({"--out", folder_ / "probe.exr"}), "probe.exr");
  refused(taken_apart(photo(), below), "file");
  refused(inserted({"--out", "/proc"}), "/proc");
  refused(edited({"--out", "/proc/edit"}), "/proc");
  refused(lit({"--out", "/proc/probe.exr"}), "/proc");
}

TEST_F(RunFolder, MissingPiecesAreNamed) {
  const fs::path lacking = folder_ / "lacking";
  fs::copy(run(), lacking);
  fs::remove(lacking / "depth.exr"), fs::remove(lacking / "albedo.exr");
  for (Words words : {inserted(), edited(), lit()}) {
    words[1] = lacking;
    expect_refused(words, "the run has no albedo.exr, no depth.exr");
    EXPECT_THAT(said(), AllOf(HasSubstr("without --only"), Not(HasSubstr("0x0"))));
    words[1] = photo();
    expect_refused(words, "a file is no run; `clerestory invert` makes one");
    words[1] = view_.parent_path();
    expect_refused(words, "is no run: it has no camera.json");
  }
  fs::remove(lacking / "provenance.json");
  expect_refused({"report", lacking}, "is no run: it has no provenance.json");
  expect_refused({"evaluate", run()}, "which view is this run of?");
}

// None of these waits for nets or lamps: a device that does not exist is never asked.
TEST_F(RunFolder, MistakesAreFoundBeforeTheWork) {
  fs::create_directory(folder_ / "no weights");
  put(folder_ / "file", "");
  const auto refused = [&](Words words, const std::string& because) {
    words.insert(words.end(), {"--device", "there is no such device"});
    expect_refused(words, because);
  };
  const auto objects = [&](const Words& words) {
    Words all{"insert", run(), "--light", "image"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  refused(objects({"--at", "32,40", "--mesh", "nothere.glb", "--size", "0.1"}), "nothere.glb: cannot be opened");
  refused(objects({"--at", "99,40", "--radius", "0.1"}), "outside of the picture");
  refused(objects({"--at", "32,40", "--radius", "-1"}), "not a length");
  refused(objects({"--at", "32,40", "--radius", "99"}), "larger than the room");
  refused(objects({"--at-point", "0,0,1", "--radius", "0.1"}), "behind the camera");
  refused(objects({"--at", "32,40", "--radius", "0.1", "--size", "0.2"}), "--size: is of a mesh");
  Scene flat = read_run(run());  // nothing is known of where a ball would stand on
  std::ranges::fill(flat.normal.data, 0.0f);
  write_exr(run() / "normal.exr", flat.normal, ExrType::Float);
  refused(objects({"--at", "32,40", "--radius", "0.1"}), "nothing is known of the normal there");
  refused(objects({"--at", "32,40", "--radius", "0.1", "--spp", "1"}), "two samples");
  const auto photographed = [&](const Words& words) {
    Words all{"invert", photo(), "--out", folder_ / "out"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  refused(photographed({"--known", "99,5,2"}),
          "--known: the point lies outside of the picture (found 99,5, expected 0..63,0..47)");
  refused(photographed({"--known", "5,5,-2"}), "not a distance");
  refused(photographed({"--known", "5,5,2", "--gbuffer", view_}), "--known: the depth is given");
  refused(photographed({"--depth-scale", "2", "--only", "normal"}), "--depth-scale: --only leaves out the depth");
  refused(photographed({"--spp", "4294967298"}), "--spp: out of range");
  refused(photographed({"--spp", "64", "--sampler", "grid8x16"}), "a grid of 8x16 directions has its number");
  refused(photographed({"--seed", "4294967296"}), "--seed: out of range");
  refused(photographed({"--light-weights", folder_ / "no weights"}), "this folder has no weights of the light");
  refused(photographed({"--light-weights", folder_ / "nothere"}), "there is no such file or folder");
  refused({"invert", photo(), "--out", photo()}, "a file stands where a folder should be");
}

TEST_F(RunFolder, SamplesAreRefusedBeforeTheWork) {
  Words words = taken_apart(photo(), folder_ / "new");
  *(std::ranges::find(words, std::string("--spp")) + 1) = std::string("1");
  expect_refused(words, "spp");
  EXPECT_THAT(said(), Not(HasSubstr("camera:"))) << "nothing was read";
}

}  // namespace
}  // namespace clerestory
