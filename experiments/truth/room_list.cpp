#include "experiments/truth/room_list.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "host/error.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "tracer/generate.hpp"
#include "tracer/random.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

Setting setting_of(const std::string& name, const std::string& where) {
  if (name == "held_out") return Setting::HeldOut;
  if (name == "training") return Setting::Training;
  throw usage_error("no setting of rooms", where, "'" + name + "'", "held_out or training");
}

std::uint64_t seed_from(const std::string& text, const std::string& where) {
  std::uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc() || end != text.data() + text.size())
    throw usage_error("not the seed of a room", where, "'" + text + "'", "a whole number of at least 0");
  return seed;
}

}  // namespace

RoomList read_room_list(const fs::path& file) {
  RoomList list;
  list.file = found_data(file);
  if (!fs::exists(list.file)) throw usage_error("there is no such list of rooms", file.string());
  std::istringstream lines(read_file(list.file, 1 << 20));
  std::string line;
  bool has_setting = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string where = fmt::format("{}:{}", file.string(), number);
    std::istringstream words(line.substr(0, line.find('#')));
    std::string word, more;
    if (!(words >> word)) continue;
    if (word == "setting") {
      words >> word;
      list.setting = setting_of(word, where), has_setting = true;
    } else {
      list.seeds.push_back(seed_from(word, where));
      if (std::count(list.seeds.begin(), list.seeds.end(), list.seeds.back()) > 1)
        throw usage_error("the room stands in the list twice", where, word);
    }
    if (words >> more) throw usage_error("more than one entry in a line", where, "'" + more + "'");
  }
  if (!has_setting) throw usage_error("the list says no setting", file.string(), "", "a line 'setting held_out'");
  if (const fs::path beside = fs::path(list.file).replace_extension(".rooms"); fs::exists(beside))
    list.described = beside;
  return list;
}

RoomList rooms_of(RoomList list, std::size_t count, std::uint64_t draw) {
  if (list.seeds.size() < count)
    throw usage_error("the list has fewer rooms", list.file.string(), fmt::format("{}", list.seeds.size()),
                      fmt::format("{} (data.rooms)", count));
  Random random(draw);
  if (draw != 0)
    for (std::size_t i = 0; i < count; ++i)  // Fisher and Yates, as far as it is needed
      std::swap(list.seeds[i], list.seeds[i + random.bits() % (list.seeds.size() - i)]);
  list.seeds.resize(count);
  return list;
}

std::vector<Camera> ListedRoom::cameras(TraceScene& traced, const Room& room, int count, int width, int height) const {
  return described ? described->views(count, width, height)
                   : choose_views(traced, room, count, width, height, Random(seed).fork(kViewsStream));
}

}  // namespace clerestory
