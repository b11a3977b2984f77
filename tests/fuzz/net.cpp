// The shape of a net as weights state it, MGNet's in the first line or the light's: how large it is must not be up to
// the text.
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("net", "net.txt", [](const std::filesystem::path& file) {
  const std::string text = read_file(file, 1 << 20, true), where = file.string();
  if (text.find('=') == std::string::npos) {
    const MgnetSize net = net_from_text(text, where);
    if (maps_states(net) != maps_states(net_from_text(net_text(net), where)))
      throw std::logic_error("another net: " + net_text(net));
  } else {
    const LightSizes net = light_from_text(text, where);
    if (light_states(net) != light_states(light_from_text(light_text(net), where)))
      throw std::logic_error("another net: " + light_text(net));
  }
});

}  // namespace clerestory
