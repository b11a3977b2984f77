// Parameters of CLBlast's matrix product on a device, in single precision. CLBlast holds them for the whole process.
#pragma once
#include <string>

#include "host/tuning/tuning.hpp"

namespace clerestory {

/// CLBlast's own, of every kernel that its matrix product runs or chooses by.
ClblastParameters clblast_defaults(Device& device);

/// Products on the device run by these from here on, kernels that are not named by CLBlast's own. Throws usage_error
/// for a kernel or parameters that CLBlast does not have.
void use_clblast_parameters(Device& device, const ClblastParameters& parameters);

/// Those of the tuning in use, if it is for this release; else none.
ClblastParameters tuned_parameters(const Device& device);
/// Products on the device run by these from here on, unless parameters were chosen before.
void use_tuned_parameters(Device& device);

}  // namespace clerestory
