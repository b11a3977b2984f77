// Small nets with random states, as a folder of weights: what they say is not to be judged.
#pragma once
#include <filesystem>

#include "host/io/resize.hpp"
#include "nets/out_of_view.hpp"

namespace clerestory {

/// `seen`: size of the pictures that they say they were trained on.
void write_untrained_light(const std::filesystem::path& folder, const Size& seen = {40, 30},
                           OutOfViewForm form = OutOfViewForm::Field);

/// Maps and light of Li et al. 2020, as a method's folder has them.
void write_untrained_li2020(const std::filesystem::path& folder, const Size& seen);

}  // namespace clerestory
