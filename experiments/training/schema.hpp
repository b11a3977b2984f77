// Every key of a training config, with its default and meaning.
#pragma once
#include "host/io/config.hpp"

namespace clerestory {

const Schema& training_schema();

}  // namespace clerestory
