#include "host/io/iiw.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Places = std::map<std::int64_t, std::size_t>;  // of points, by id

constexpr const char *kPoints = "intrinsic_points", *kComparisons = "intrinsic_comparisons";

/// An entry of one of the two lists, and how messages call it: "photo.json" and "intrinsic_points[3]".
struct Entry {
  const Json& json;
  std::string where, name;

  const Json& member(const char* key) const {
    if (!json.is_object()) throw usage_error("wrong value of " + name, where, brief(json), "an object");
    const auto found = json.find(key);
    if (found == json.end()) throw usage_error(fmt::format("{} lacks the key {}", name, key), where);
    return *found;
  }
  Error wrong(const char* key, const std::string& expected) const {
    return usage_error(fmt::format("wrong value of {}.{}", name, key), where, brief(json[key]), expected);
  }
};

const Json& list_of(const Json& json, const char* key, const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) throw usage_error(fmt::format("the key {} is missing", key), where);
  if (!found->is_array()) throw usage_error(fmt::format("wrong value of {}", key), where, brief(*found), "a list");
  return *found;
}

double fraction(const Entry& entry, const char* key) {
  const Json& value = entry.member(key);
  if (!value.is_number() || !(value.get<double>() >= 0 && value.get<double>() <= 1))
    throw entry.wrong(key, "a fraction of the picture's side, 0 to 1");
  return value.get<double>();
}

JudgedPoint point_of(const Entry& entry) {
  JudgedPoint point;
  point.id = whole_number<std::int64_t>(entry.member("id"), entry.name + ".id", entry.where);
  point.x = fraction(entry, "x"), point.y = fraction(entry, "y");
  const Json& opaque = entry.member("opaque");
  if (!opaque.is_boolean() && !opaque.is_null()) throw entry.wrong("opaque", "true or false");
  point.opaque = opaque.is_boolean() && opaque.get<bool>();
  return point;
}

std::size_t point_named(const Entry& entry, const char* key, const Places& places) {
  const auto id = whole_number<std::int64_t>(entry.member(key), entry.name + "." + key, entry.where);
  const auto found = places.find(id);
  if (found == places.end()) throw entry.wrong(key, fmt::format("the id of one of {}", kPoints));
  return found->second;
}

JudgedPair judgement_of(const Entry& entry, const Places& places) {
  JudgedPair judgement;
  judgement.first = point_named(entry, "point1", places), judgement.second = point_named(entry, "point2", places);
  const Json& darker = entry.member("darker");
  if (darker.is_null()) return judgement;
  const std::string word = darker.is_string() ? darker.get<std::string>() : "";
  if (word != "1" && word != "2" && word != "E") throw entry.wrong("darker", "\"1\", \"2\", \"E\" or null");
  judgement.darker = word == "1" ? Darker::First : word == "2" ? Darker::Second : Darker::Equal;
  const Json& score = entry.member("darker_score");
  if (!score.is_number()) throw entry.wrong("darker_score", "a number");
  judgement.weight = score.get<double>();
  return judgement;
}

}  // namespace

Judgements read_judgements(const fs::path& path) {
  const std::string where = path.string();
  const Json json = read_json_object(path);
  Judgements all;
  Places places;
  for (const Json& value : list_of(json, kPoints, where)) {
    const Entry entry{value, where, fmt::format("{}[{}]", kPoints, all.points.size())};
    all.points.push_back(point_of(entry));
    if (!places.emplace(all.points.back().id, all.points.size() - 1).second)
      throw usage_error(fmt::format("an id of {} is there twice", kPoints), where, brief(value["id"]));
  }
  if (all.points.empty()) throw usage_error(fmt::format("{} holds no point", kPoints), where);
  for (const Json& value : list_of(json, kComparisons, where))
    all.comparisons.push_back(
        judgement_of({value, where, fmt::format("{}[{}]", kComparisons, all.comparisons.size())}, places));
  return all;
}

void write_judgements(const fs::path& path, const Judgements& judgements) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array(), comparisons = nlohmann::ordered_json::array();
  for (const JudgedPoint& point : judgements.points)
    points.push_back({{"id", point.id}, {"x", point.x}, {"y", point.y}, {"opaque", point.opaque}});
  for (const JudgedPair& judgement : judgements.comparisons) {
    nlohmann::ordered_json one{{"id", comparisons.size() + 1},
                               {"point1", judgements.points.at(judgement.first).id},
                               {"point2", judgements.points.at(judgement.second).id},
                               {"darker", nullptr},
                               {"darker_score", nullptr}};
    if (judgement.darker)
      one["darker"] = *judgement.darker == Darker::First    ? "1"
                      : *judgement.darker == Darker::Second ? "2"
                                                            : "E",
      one["darker_score"] = judgement.weight;
    comparisons.push_back(std::move(one));
  }
  write_file(path, nlohmann::ordered_json{{kPoints, points}, {kComparisons, comparisons}}.dump(1) + "\n");
}

std::vector<IiwPicture> list_iiw(const fs::path& folder) {
  std::error_code code;
  fs::directory_iterator entries(folder, code);
  if (code) throw usage_error("the folder cannot be read: " + code.message(), folder.string());
  std::vector<IiwPicture> all;
  for (const auto& entry : entries) {
    if (entry.path().extension() != ".json" || entry.path().filename().string()[0] == '.') continue;
    IiwPicture one{entry.path().stem().string(), {}, entry.path()};
    for (const char* extension : {".png", ".jpg"})
      if (fs::path picture = folder / (one.id + extension); one.picture.empty() && fs::exists(picture))
        one.picture = std::move(picture);
    if (one.picture.empty())
      throw usage_error("has no picture beside it", one.judgements.string(), {}, one.id + ".png or .jpg");
    all.push_back(std::move(one));
  }
  if (all.empty())
    throw usage_error("holds no judgements", folder.string(), "no <id>.json", "<id>.json beside <id>.png");
  std::ranges::sort(all, {}, &IiwPicture::id);
  return all;
}

std::vector<IiwPicture> iiw_split(const std::vector<IiwPicture>& all, bool test) {
  std::vector<IiwPicture> kept;
  for (std::size_t i = 0; i < all.size(); ++i)
    if ((i % 5 == 0) == test) kept.push_back(all[i]);
  return kept;
}

}  // namespace clerestory
