// A method: nets of the maps and of the light that belong together, as weights in a folder that say whose they are.
#pragma once
#include <filesystem>
#include <string>

namespace clerestory {

struct Method {
  std::string name;                     // whose nets: zhu | li2020
  std::string light;                    // that the weights answer for: light_of()
  std::filesystem::path maps;           // weights of the maps, a file
  std::filesystem::path light_weights;  // the folder of the light's
};

/// By name "zhu", whose weights come with the program (shipped_weights(), light_or_shipped()), or "li2020", from a
/// folder of that name beside them; else a folder that holds maps.safetensors, light_local.safetensors and
/// light_global.safetensors. `option` is what asks for it, for messages. Throws usage_error: no such method or folder,
/// a file that is missing, weights of another method.
Method find_method(const std::string& name_or_folder, const std::string& option);

}  // namespace clerestory
