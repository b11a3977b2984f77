#include "experiments/applications/render_record.hpp"

#include "experiments/applications/light_choice.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nesting.hpp"
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

/// Of all files behind a light's weights.
std::string hash_of(const fs::path& weights) {
  std::vector<std::string> hashes;
  for (const fs::path& file : weights_files(weights)) hashes.push_back(file_hash(file));
  return fmt::format("{}", fmt::join(hashes, " "));
}

RenderRecord record_of(const Json& json, const std::string& where) {
  RenderRecord record;
  RenderSettings& s = record.settings;
  s.light = json.at("light"), s.sampler = json.at("sampler"), s.points = json.at("points"), s.ssrt = json.at("ssrt");
  s.delta = json.at("delta"), s.thickness = json.at("thickness"), s.brdf = json.at("surface model");
  record.shared = json.at("shared answers");
  record.weights = json.at("light weights").get<std::string>();
  record.weights_hash = json.value("hash of light weights", "");  // runs of before have none
  s.leave_out.clear();
  for (const std::string name : json.at("left out")) {
    const auto* kind = std::ranges::find(kSavings, name, &SavingKind::name);
    if (kind == kSavings.end())
      throw usage_error("unknown name of what is left out", where, name, "as `invert` wrote it");
    s.leave_out.insert(kind->saving);
  }
  for (const Json& lamp : json.at("lamps")) s.lamps.push_back(lamp_of(lamp));
  for (const Json& round : json.at("rounds"))
    record.rounds.push_back({whole_number<int>(round.at("spp"), "spp", where),
                             whole_number<std::uint32_t>(round.at("seed"), "seed", where)});
  if (record.rounds.empty()) throw usage_error("no samples were taken", where, "no rounds");
  for (const SampleRound& round : record.rounds)
    if (round.spp < 1) throw usage_error("wrong value of spp", where, fmt::format("{}", round.spp), "at least 1");
  s.spp = record.rounds[0].spp, s.seed = record.rounds[0].seed;
  s.sharing = record.shared ? Sharing::Always : Sharing::Never;
  return record;
}

}  // namespace

void write_render_record(const fs::path& path, const RenderRecord& record) {
  const RenderSettings& s = record.settings;
  Json json{{"light", s.light},
            {"light weights", s.nets ? fs::absolute(s.nets->note).string() : ""},
            {"hash of light weights", s.nets ? hash_of(s.nets->note) : ""},
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
  write_file(path, json_text(json) + "\n");
}

RenderRecord parse_render_record(const fs::path& path) {
  if (!fs::exists(path))
    throw usage_error("the run does not say how it was rendered", path.string(), "no such file",
                      "a folder that `clerestory invert` wrote without --only");
  const std::string text = read_file(path, kMostBytes);
  check_nesting(text, path.string());
  try {
    return record_of(Json::parse(text), path.string());
  } catch (const nlohmann::json::exception& error) {
    throw usage_error("this is no record of a re-render", path.string(), error.what(),
                      "what `clerestory invert` wrote");
  }
}

RenderRecord read_render_record(const fs::path& path, Device device) {
  RenderRecord record = parse_render_record(path);
  load_light_nets(record.settings, record.weights, std::move(device));
  if (!record.settings.nets || record.weights_hash.empty()) return record;
  if (const std::string now = hash_of(record.weights); now != record.weights_hash)
    throw usage_error("the light's weights are not those that the run was rendered with", record.weights.string(),
                      "hash " + now, record.weights_hash);
  return record;
}

}  // namespace clerestory
