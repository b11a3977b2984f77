// Makes a data set of generated rooms in InteriorVerse's layout.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/cl/device.hpp"
#include "tracer/room.hpp"
#include "tracer/room_file.hpp"
#include "tracer/views.hpp"

namespace clerestory {

/// As many rooms, or views, as a file has.
inline constexpr int kAllRooms = std::numeric_limits<int>::min();

/// Which rooms.
struct RoomChoice {
  int count = 1;
  std::uint64_t seed = 0;            // rooms of different seeds share nothing
  std::vector<std::uint64_t> seeds;  // one a room, in place of those that follow from `seed`; or empty
  /// Rooms and cameras as a file describes them (tracer/room_file.hpp), in place of made ones: its first `count`, and
  /// of each the first ViewChoice::count, either of which may be kAllRooms; `setting`, `seed` and `boxes` have no say.
  /// Empty: rooms are made. With `seeds`: the rooms of the file that have them.
  std::filesystem::path from;
  Setting setting = Setting::Training;
  bool boxes = false;            // bare boxes instead of furnished rooms
  int shard = 0, shards = 1;     // this run makes rooms shard, shard + shards, ...
  std::string split = "auto";    // auto: of ten rooms eight train, one val, one test; else all rooms go there
  std::filesystem::path assets;  // folder with hdri/ and models/; empty: default_assets()
};

/// Which views of each, and how they are traced.
struct ViewChoice {
  int count = 5;
  int width = 160, height = 120, spp = 64;
  bool variance = true;  // also that of the picture's mean, which only those read who judge by it
  double clamp = 0;      // most one indirect contribution adds, in units of the picture's white; 0: no bound
  Handling handling;     // of cameras that are chosen, not read from a file
};

/// Environment maps and probes (host/io/light_files.hpp).
struct LightWanted {
  bool wanted = true;
  int spp = 16;    // samples of a texel of an environment map; a probe's takes four times as many
  int probes = 2;  // of a view; fewer where the view has no place for them
};

struct GenerateOptions {
  std::filesystem::path out;
  RoomChoice rooms;
  ViewChoice views;
  LightWanted light;
  bool balls = false;
  /// Metres to the right at which a second camera stands (tracer/stereo.hpp), above 0; nothing: there is none.
  std::optional<double> baseline;
  bool mitsuba = false;  // beside a room's views a folder mitsuba/ with its scene (tracer/mitsuba_export.hpp)
  /// Called after each view, made or skipped; `total` counts this shard's views. May be empty.
  std::function<void(int done, int total, bool made)> progress;
  /// Asked before each view; true ends the run with ErrorKind::Interrupted. May be empty.
  std::function<bool()> interrupted;
};

struct GenerateSummary {
  int made = 0, skipped = 0;  // views
  int views() const { return made + skipped; }
  double seconds = 0;         // of the views made
  double light_seconds = 0;   // of these, of environment maps and probes
  int scenes = 0;             // of Mitsuba, written
  long dropped = 0;           // samples that were not finite
  std::string first_dropped;  // "room/view pixel sample seed", to be replayed; empty when none was

  void add(const GenerateSummary& other);
};

/// Writes <out>/<room>/NNN_*.exr and .json, generate.json and those of train.txt, val.txt, test.txt that have rooms. A
/// view that is complete is skipped, a scene that is there too, so a killed run goes on where it stopped and ends in
/// the same bits. Throws usage_error on options out of range and on a folder made with other options; Error
/// (Interrupted) when asked to stop.
GenerateSummary generate(const Device& device, const GenerateOptions& options);

/// Makes rooms of a set one at a time, in any order: what generate() does, without its lists and its claim on a folder.
class RoomMaker {
 public:
  /// Loads the assets. Throws usage_error on options out of range.
  RoomMaker(const Device& device, const GenerateOptions& options);
  ~RoomMaker();
  std::string name(int index) const;
  /// Writes those views of room `index` that its folder lacks. Throws Error (Interrupted) between two of them when
  /// asked to stop.
  void make(int index, GenerateSummary& summary);

 private:
  friend GenerateSummary generate(const Device& device, const GenerateOptions& options);
  struct State;
  std::unique_ptr<State> state_;
};

/// The rooms that generate() makes of such options, with their cameras, as files keep them. Nothing is traced but what
/// cameras are judged by. Throws as generate() does.
RoomFile describe_rooms(const Device& device, const GenerateOptions& options);

/// The text of the generate.json that such options give, those of a file of rooms with its setting and seed 0.
std::string recipe_text(const GenerateOptions& options, const std::string& assets_hash = {});

/// The folder of panoramas and models: CLERESTORY_ASSETS, else `assets` where data_places() says.
/// Throws usage_error when there is none.
std::filesystem::path default_assets();

/// Name of a made room: "room-s<seed>-<index>", with "held-out-" before it in that setting.
std::string room_name(const GenerateOptions& options, int index);
/// Seed from which make_room, or make_box_room, makes a room of the set.
std::uint64_t room_seed(const GenerateOptions& options, int index);
/// The split that a room belongs to.
std::string split_of(const GenerateOptions& options, int index);

}  // namespace clerestory
