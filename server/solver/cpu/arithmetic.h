// What this processor computes with, in words.
#pragma once

#include <cstdint>
#include <string>

namespace drape::cpu {

// "AMD EPYC, 16 lanes (AVX3)"; with one lane "AMD EPYC, no lanes". States with the same words have
// the same bits after a step.
std::string ArithmeticOf(uint32_t lane_count);

}  // namespace drape::cpu
