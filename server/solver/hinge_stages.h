// Hinges of any strength by a few forces per substep: the stages of a stabilised
// (Runge-Kutta-Chebyshev) method (van der Houwen and Sommeijer 1980; formulas in
// server/solver/method.md, "solve_hinges").
#pragma once

#include <compare>
#include <cstdint>
#include <vector>

namespace drape {

// Stage j changes velocities by d_j = momentum d_(j-1) + gain * (the kick from where the particles
// will be at the velocities so far).
struct HingeStage {
  double momentum = 0;
  double gain = 0;

  friend auto operator<=>(const HingeStage&, const HingeStage&) = default;
};

// The largest s omega^2 [-] that this many stages hold: beyond, what is too fast is thrown back by
// more than kHingeResidual. About 0.75 count^2.
double LargestHingeRatio(uint32_t count);

// The fewest stages for elements of this s omega^2 [-], at most kMaxHingeStages.
uint32_t HingeStageCount(double ratio);

// count <= kMaxHingeStages.
std::vector<HingeStage> HingeStages(uint32_t count);

}  // namespace drape
