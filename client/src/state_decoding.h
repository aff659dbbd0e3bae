// States of 16-bit numbers become arrays of floats in the world frame.
#pragma once

#include <cstdint>
#include <string>

#include "drape/error.h"
#include "drape/v1/state.pb.h"

namespace drape {
inline namespace client {

// Of states whose parts do not belong together.
Error MalformedStates(const std::string& what);

// IEEE 754 binary16 to binary32, exactly.
float FloatOfHalf(uint16_t half);

// Puts FLOAT32 arrays in the place of FLOAT16 and INT16 ones; leaves other chunks as they are.
// Throws Error (kInternal) when counts, origins, steps and bytes do not belong together.
void DecodeStates(v1::StateChunk* chunk);

}  // namespace client
}  // namespace drape
