#include "experiments/studies/ladder_study.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/studies/intervals.hpp"
#include "experiments/studies/ladder_room.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/strip.hpp"
#include "host/math/statistics.hpp"
#include "tracer/balls.hpp"

namespace clerestory {
namespace {

constexpr int kMostStrips = 4;                            // rooms shown
constexpr double kLeastPsnr = 20, kMostOfConstant = 0.5;  // the bar for the re-render with true maps

class LadderStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    options_.render.light = "net", options_.render.spp = config_.whole("ladder.spp");
    use_light_of_two_parts(options_.render);
    options_.maps_weights = use_maps();
    options_.width = config_.whole("data.width");
    options_.height = config_.whole("data.height");
    options_.picture_spp = config_.whole("data.spp");
    options_.emission_spp = config_.whole("ladder.emission_spp");
    options_.seeds = config_.whole("ladder.seeds");
    measure_rooms([this](const ListedRoom& listed) {
      LadderRoom room = climb_ladder(device_, listed, options_);
      const std::int64_t r = listed.index;
      for (const auto& [job, strip] : room.strips)
        if (r < kMostStrips) write_strip(run_.artifact(fmt::format("room{}_{}_tracer_then_rungs.png", r, job)), strip);
      return std::move(room.found);
    });
  }

  /// Over seeds: means over rooms and jobs; nothing where no room has such a job.
  std::optional<Measure> over_seeds(const std::vector<std::string>& jobs, const char* metric,
                                    const std::string& rung) const {
    std::vector<double> seeds;
    for (std::int64_t s = 0; s < config_.integer("ladder.seeds"); ++s) {
      std::vector<double> all;
      for (const std::string& job : jobs)
        for (const double v : found().values(Finding{metric, job, rung}.of(s))) all.push_back(v);
      if (all.empty()) return std::nullopt;
      seeds.push_back(mean(all));
    }
    return measure_of(seeds);
  }
  /// relMSE of each room: the mean over seeds and those of the jobs that it has, or NaN.
  std::vector<double> by_room(const std::vector<std::string>& jobs, const std::string& rung) const {
    std::vector<double> rooms;
    for (std::size_t r = 0; r < found().rooms(); ++r) {
      std::vector<double> all;
      for (const std::string& job : jobs)
        for (const auto& [seed, value] : found().items(r, {"relmse", job, rung})) all.push_back(value);
      rooms.push_back(all.empty() ? NAN : mean(all));
    }
    return rooms;
  }
  /// Over rooms, each by its mean over seeds.
  double median_of_rooms(const char* metric, const std::string& rung) const {
    std::vector<double> means;
    for (const auto& seeds : found().present_by_seed({metric, "render", rung}, config_.integer("ladder.seeds")))
      means.push_back(mean(seeds));
    return median(means);
  }

  static const std::vector<std::string>& render_only() {
    static const std::vector<std::string> jobs{"render"};
    return jobs;
  }
  static std::vector<std::string> balls() {
    std::vector<std::string> names;
    for (const BallKind& kind : ball_kinds()) names.push_back(kind.name);
    return names;
  }

  /// relMSE, change against `before`, PSNR of some jobs at a rung.
  void add_errors(std::vector<Cell>& row, const std::vector<std::string>& jobs, const std::string& rung,
                  const std::string& before) const {
    const auto relmse = over_seeds(jobs, "relmse", rung), psnr = over_seeds(jobs, "psnr", rung);
    Cell change;
    if (relmse && !before.empty()) {
      const auto changed = clear_change(by_room(jobs, before), by_room(jobs, rung));
      change = changed ? fmt::format("{:+.0f} %", 100 * *changed) : std::string("none");
    }
    row.push_back(relmse ? Cell(*relmse) : Cell()), row.push_back(change), row.push_back(psnr ? Cell(*psnr) : Cell());
  }

  void add_row(Table& table, const std::string& label, const std::string& rung, const std::string& before) const {
    std::vector<Cell> row{label};
    add_errors(row, render_only(), rung, before);
    add_errors(row, balls(), rung, before);
    const auto seconds = over_seeds(render_only(), "seconds", rung);
    row.push_back(seconds ? Cell(*seconds) : Cell());
    table.add(std::move(row));
  }

  Table ladder_table() const {
    Table table;
    table.title = fmt::format(
        "The oracle ladder: means over {} rooms, {} samples a pixel; spread over {} seeds of the layer; a change whose "
        "interval of 95 %, room by room, holds 0 is none; predicted depth is brought to scale at the ball's foot; "
        "nets, lamps and simple lights read the photograph as it was traced, not clipped; "
        "relMSE without the noise of layer "
        "and reference, but for the best constant's, and PSNR with it; the re-render is what lamps were fitted to",
        found().rooms(), config_.integer("ladder.spp"), config_.integer("ladder.seeds"));
    table.columns = {{"links"},
                     {"re-render relMSE", "eps 0.01, no noise"},
                     {"change", "relMSE"},
                     {"PSNR", "dB, linear, clipped at 1", Best::None, 4},
                     {"balls relMSE", "eps 0.01, no noise"},
                     {"change", "relMSE"},
                     {"PSNR", "dB, linear, clipped at 1", Best::None, 4},
                     {"time", "s a re-render"}};
    const std::string first = rungs().front().key;
    add_row(table, "all predicted", first, "");
    for (const char* alone : {"hits", "in view", "out of view", "maps"})
      add_row(table, std::string(alone) + " true alone", alone, first);
    std::string before = first, label;
    for (const auto& [key, more] : {std::pair{"hits", "hits"},
                                    {"hits, in view", "+ in view"},
                                    {"all light", "+ out of view"},
                                    {"all", "+ maps: all true"}}) {
      add_row(table, std::string("true in turn: ") + more, key, before);
      before = key;
    }
    add_row(table, kWithBall, kWithBall, before);
    for (const bool truth : {true, false})
      for (const std::string& light : plain_lights())
        add_row(table, "light = " + plain_key(light, truth), plain_key(light, truth), "");
    add_row(table, kBestConstant, kBestConstant, "");
    return table;
  }

  Table balls_table() const {
    Table table;
    table.title = "The same by ball; PSNR of linear values, clipped at 1";
    table.columns = {{"links"}};
    std::vector<std::string> keys;
    for (const Rung& rung : rungs()) keys.push_back(rung.key);
    keys.push_back(kWithBall);
    for (const bool truth : {true, false})
      for (const std::string& light : plain_lights()) keys.push_back(plain_key(light, truth));
    for (const std::string& ball : balls())
      for (const char* what : {"relMSE", "change", "PSNR"}) table.columns.push_back({ball + " " + what});
    for (const std::string& key : keys) {
      std::vector<Cell> row{key};
      const bool changes = key != rungs().front().key && key.find("maps") == std::string::npos;
      for (const std::string& ball : balls()) add_errors(row, {ball}, key, changes ? rungs().front().key : "");
      table.add(std::move(row));
    }
    return table;
  }

  /// "Re-render with true maps": what it must reach, and what it does.
  Table bar_table() const {
    Table table;
    table.title = "Re-render with true maps and predicted light: what it must reach";
    table.columns = {{"figure"},
                     {"mean over rooms", "", Best::None, 4},
                     {"median over rooms", "", Best::None, 4},
                     {"bar"},
                     {"mean reaches it"}};
    const std::string constant = plain_key("constant", true);
    for (const auto& [key, light] :
         {std::pair<std::string, std::string>{"maps", "nets alone"}, {plain_key("net+lamps", true), "with lamps"}}) {
      const Measure psnr = *over_seeds(render_only(), "psnr", key), ours = *over_seeds(render_only(), "relmse", key);
      const double share = ours.mean / over_seeds(render_only(), "relmse", constant)->mean;
      table.add({"PSNR, dB, linear, clipped at 1, " + light, psnr, Measure{median_of_rooms("psnr", key)},
                 fmt::format("at least {}", kLeastPsnr), psnr.mean >= kLeastPsnr ? "yes" : "no"});
      table.add({"relMSE over a constant ambient's, " + light, Measure{share},
                 Measure{median_of_rooms("relmse", key) / median_of_rooms("relmse", constant)},
                 fmt::format("at most {}", kMostOfConstant), share <= kMostOfConstant ? "yes" : "no"});
    }
    return table;
  }

  /// The link whose truth alone lowers the error most, in more rooms than chance would have it.
  std::string limit_of(const std::vector<std::string>& jobs) const {
    const std::vector<double> start = by_room(jobs, rungs().front().key);
    if (std::ranges::none_of(start, [](double v) { return std::isfinite(v); })) return "no room has it";
    std::string link = "none of them alone";
    double least = 0;
    for (const char* alone : {"hits", "in view", "out of view", "maps"}) {
      const auto change = clear_change(start, by_room(jobs, alone));
      if (change && *change < least)
        least = *change, link = fmt::format("{} (alone true: {:+.0f} % relMSE)", alone, 100 * least);
    }
    return link;
  }

  void conclude() override {
    write_table("ladder", ladder_table());
    std::fputs("\n", stdout);
    write_table("ladder_balls", balls_table());
    std::fputs("\n", stdout);
    write_table("ladder_bar", bar_table());
    provenance_.facts["what limits the re-render"] = limit_of(render_only());
    provenance_.facts["what limits balls"] = limit_of(balls());
    provenance_.figures["paths dropped as not finite"] = sum(found().values({"dropped"}));
    provenance_.figures["rooms with a ball"] = sum(found().values({"ball"}));
  }

  LadderOptions options_;
};

}  // namespace

std::optional<double> clear_change(const std::vector<double>& before, const std::vector<double>& after) {
  const auto difference = roomwise_difference(after, before);
  if (!difference || (difference->verdict != "higher" && difference->verdict != "lower")) return std::nullopt;
  double base = 0;  // over the rooms that the difference is over
  for (std::size_t r = 0; r < before.size(); ++r)
    if (std::isfinite(before[r]) && std::isfinite(after[r])) base += before[r] / difference->rooms;
  return difference->mean / base;
}

void add_ladder_keys(Schema& schema) {
  schema.section("ladder", "Links of the learned light replaced by the truth.")
      .integer("ladder.spp", 64, "Samples a pixel of the layer", {2, 65536})
      .integer("ladder.emission_spp", 1024, "Samples a pixel of true light from emitters", {2, 65536})
      .integer("ladder.seeds", 3, "Repetitions with other seeds", {3, 1000});
}

std::string run_ladder_study(const Config& config, const std::vector<std::string>& command) {
  return LadderStudy(config, command).run();
}

}  // namespace clerestory
