// The settings that the curve compares, as data.
#pragma once

#include <vector>

#include "tests/bench/accuracy/methods.h"

namespace drape::bench {

// The presets that a frame can afford, and families of switches at rising numbers of substeps,
// each exactly the number of its name.
std::vector<Method> CurveMethods();

}  // namespace drape::bench
