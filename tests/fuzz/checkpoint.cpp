// Checkpoints of a training of one parameter, as a leg goes on from them or starts from them: states, progress, history
// and second moments.
#include "experiments/training/checkpoint.hpp"

#include "experiments/weights/moments.hpp"
#include "experiments/weights/stored_states.hpp"
#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {
namespace {

States begun() {
  States states(Device::open());
  for (const char* name : {"w", "adam.m.w", "adam.v.w"}) states.set(name, Tensor({1, 2, 1, 3}));
  return states;
}

const FuzzTarget target("checkpoint", "step-00000003.safetensors", [](const std::filesystem::path& path) {
  static States states = begun();
  const std::string where = path.string();
  const TensorFile file = read_finite_safetensors(path);
  const History history = stored_history(file, where);
  history_plot(history), lists_plot(history), model_card(history, {}, {});
  history_from_json(history_json(history), where);
  set_moments(states, stored_moments(file, where), where);
  const RunIdentity identity{"compact", "net", {32, 32}, 1, "hash", 7};
  write_checkpoint(path, states, go_on_from(file, where, states, identity), identity);
  go_on_from(read_finite_safetensors(path), where, states, identity);
});

}  // namespace
}  // namespace clerestory
