// Where the particles of a cloth are expected within a step in which no parts of it can touch.
#pragma once

#include <span>

#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// At the time t of the step a particle is expected t times its velocity from where it was at the
// start. As long as none is farther from there than `drift`, relative to any other, at the end of
// any substep, the stages of self-contacts have nothing to do (server/solver/method.md).
struct ExpectedFlight {
  std::span<const Vec4> velocities;  // [particle_count] [m/s]
  float drift = 0;                   // [m]
  float substep_s = 0;               // [s]
};

}  // namespace drape::cpu
