#include "experiments/applications/render_record.hpp"

#include <nlohmann/json.hpp>

#include "experiments/applications/light_choice.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 20;

Json json_of(const SoftLamp& lamp) {
  return {{"place", {lamp.place.x, lamp.place.y, lamp.place.z}}, {"size", lamp.size}, {"radiance", lamp.radiance}};
}

SoftLamp lamp_of(const Json& json) {
  const auto place = json.at("place").get<std::array<double, 3>>();
  return {
      {place[0], place[1], place[2]}, json.at("size").get<double>(), json.at("radiance").get<std::array<double, 3>>()};
}

RenderRecord record_of(const Json& json, fs::path& weights) {
  RenderRecord record;
  RenderSettings& s = record.settings;
  s.light = json.at("light"), s.sampler = json.at("sampler"), s.points = json.at("points"), s.ssrt = json.at("ssrt");
  s.delta = json.at("delta"), s.thickness = json.at("thickness"), s.brdf = json.at("surface model");
  record.shared = json.at("shared answers");
  weights = json.at("light weights").get<std::string>();
  s.leave_out.clear();
  for (const std::string name : json.at("left out")) {
    const auto* kind = std::ranges::find(kSavings, name, &SavingKind::name);
    if (kind == kSavings.end())
      throw usage_error("unknown name of what is left out", "left out", name, "as `invert` wrote it");
    s.leave_out.insert(kind->saving);
  }
  for (const Json& lamp : json.at("lamps")) s.lamps.push_back(lamp_of(lamp));
  for (const Json& round : json.at("rounds"))
    record.rounds.push_back({round.at("spp").get<int>(), round.at("seed").get<std::uint32_t>()});
  if (record.rounds.empty()) throw usage_error("no samples were taken", "rounds", "none");
  s.spp = record.rounds[0].spp, s.seed = record.rounds[0].seed;
  s.sharing = record.shared ? Sharing::Always : Sharing::Never;
  return record;
}

}  // namespace

void write_render_record(const fs::path& path, const RenderRecord& record) {
  const RenderSettings& s = record.settings;
  Json json{{"light", s.light},
            {"light weights", s.nets ? fs::absolute(s.nets->note).string() : ""},
            {"sampler", s.sampler},
            {"points", s.points},
            {"ssrt", s.ssrt},
            {"delta", s.delta},
            {"thickness", s.thickness},
            {"surface model", s.brdf},
            {"shared answers", record.shared},
            {"left out", Json::array()},
            {"rounds", Json::array()},
            {"lamps", Json::array()}};
  for (const Saving saving : s.leave_out) json["left out"].push_back(kind_of(saving).name);
  for (const SampleRound& round : record.rounds) json["rounds"].push_back({{"spp", round.spp}, {"seed", round.seed}});
  for (const SoftLamp& lamp : s.lamps) json["lamps"].push_back(json_of(lamp));
  write_file(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

RenderRecord read_render_record(const fs::path& path, Device device) {
  if (!fs::exists(path))
    throw usage_error("the run does not say how it was rendered", path.string(), "no such file",
                      "a folder that `clerestory invert` wrote without --only");
  RenderRecord record;
  fs::path weights;
  try {
    record = record_of(Json::parse(read_file(path, kMostBytes)), weights);
  } catch (const nlohmann::json::exception& error) {
    throw usage_error("this is no record of a re-render", path.string(), error.what(),
                      "what `clerestory invert` wrote");
  }
  load_light_nets(record.settings, weights, std::move(device));
  return record;
}

}  // namespace clerestory
