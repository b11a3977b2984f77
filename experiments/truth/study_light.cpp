#include "experiments/truth/study_light.hpp"

#include <algorithm>
#include <cstdio>
#include <map>

#include "host/error.hpp"
#include "nets/constant_light.hpp"

namespace clerestory {

namespace {

bool has_level(const std::string& light) {
  return light == "constant" || light == "image" || light == "panorama" || light == "mirrored";
}

}  // namespace

StudyLight study_light(const std::string& name) {
  const std::size_t plus = std::min(name.find('+'), name.size()), space = std::min(name.find(' '), name.size());
  StudyLight study{name.substr(0, plus), plus < space ? name.substr(plus + 1, space - plus - 1) : "", {}};
  if (plus < name.size() && study.fitted != "lamps" && !(study.fitted == "fit" && has_level(study.light)))
    throw usage_error("nothing of that name is fitted to a light", name, study.fitted,
                      "LIGHT+lamps, or constant+fit, image+fit, panorama+fit, mirrored+fit");
  if (study.fitted == "fit") study.fit = kConstantFit;
  if (space == name.size()) return study;
  const std::string weights = name.substr(space + 1);
  int read = 0;
  if (std::sscanf(weights.c_str(), "%lf,%lf%n", &study.fit.floor, &study.fit.ridge, &read) != 2 ||
      static_cast<std::size_t>(read) != weights.size() || !(study.fit.floor > 0 && study.fit.ridge > 0))
    throw usage_error("a fit has two weights above 0", name, weights, "LIGHT+lamps FLOOR,RIDGE");
  return study;
}

namespace {

/// "net" as the nets at hand have it.
std::string light_of(const StudyLight& study, const RenderSettings& base) {
  return study.light == "net" && base.nets ? light_of(base.nets->sizes) : study.light;
}

}  // namespace

std::string light_label(const std::string& name, const std::string& whose) {
  static const std::map<std::string, std::string> known{
      {"net", "learned light"},
      {"completed", "the photograph, learned light out of view"},
      {"out_of_view", "learned light out of view"},
      {"li2020", "learned light"},
      {"image", "the photograph as light"},
      {"panorama", "the photograph at infinity"},
      {"mirrored", "the photograph mirrored all around"},
      {"constant", "mean colour of the photograph"},
  };
  const StudyLight study = study_light(name);
  const std::string owner = is_learned_light(study.light) ? whose + ": " : "";
  const std::string weights = name.substr(std::min(name.find(' '), name.size()));
  if (study.light == "constant" && study.fitted == "fit") return "one constant, fitted as lamps are" + weights;
  return owner + known.at(study.light) +
         (study.fitted == "lamps" ? ", lamps fitted"
          : study.fitted == "fit" ? ", as bright as shading says"
                                  : "") +
         weights;
}

bool nets_answer(const RenderSettings& base, const std::string& name) {
  const std::string light = light_of(study_light(name), base);
  return base.nets ? nets_fit(light, base.nets->sizes) : !is_learned_light(light);
}

RenderSettings under_light(RenderSettings base, const std::string& name, Device& device, const Scene& scene) {
  const StudyLight study = study_light(name);
  base.light = light_of(study, base);
  base.fit = study.fit;
  if (study.fitted == "lamps") base.lamps = fit_lamps(device, scene, base).lamps;
  if (study.fitted == "fit" && study.light == "constant") base.constant = fit_constant(device, scene, base);
  if (study.fitted == "fit" && study.light != "constant") base.level = fit_level(device, scene, base);
  return base;
}

}  // namespace clerestory
