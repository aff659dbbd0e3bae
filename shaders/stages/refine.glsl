// Stage `refine`, rounds of: flags at the ends of links that are far off, then the constraints at flagged
// particles once more. Needs the accessors of one plan.
#include "stages/solve_distance.glsl"

void TestLink(uint constraint) {
  uvec2 pair = ConstraintPair(constraint);
  precise vec3 position_difference = Position(pair.y) - Position(pair.x);
  precise vec3 velocity_difference = Velocity(pair.y) - Velocity(pair.x);
  vec3 d = AddScaled(position_difference, substep.interval, velocity_difference);
  float rest_length = ModelFloat(cloth.rest_lengths + constraint);
  if (!IsFarOff(d, rest_length, cloth.shortest_sq, cloth.longest_sq)) return;
  FlagParticle(pair.x);
  FlagParticle(pair.y);
}

// The tiled plan dispatches what any cloth needs.
bool IsRefinedIn(uint substep_index, uint sweep, uint refine_round) {
  return substep_index + 1u == cloth.substeps && sweep + 1u == cloth.max_iterations &&
         refine_round < cloth.refine_rounds;
}

bool IsAtFlag(uint constraint) {
  uvec2 pair = ConstraintPair(constraint);
  return IsFlagged(pair.x) || IsFlagged(pair.y);
}

// It is no sweep and says nothing of convergence. Strips have no accumulated impulses to begin here.
void RefineConstraint(uint constraint) { SolveConstraint(constraint, false, true); }
