// Stage `refine`. Each round flags the ends of links that the strips left stretched, then moves the constraints
// at flagged particles. Needs the accessors of one plan.
#include "lib/distance.glsl"
#include "stages/substep.glsl"

void TestLink(uint constraint) {
  uvec2 pair = ConstraintPair(constraint);
#ifdef HAS_GRIPS
  if (InverseMass(pair.x) == 0.0 && InverseMass(pair.y) == 0.0) return;
#endif
  precise vec3 position_difference = Position(pair.y) - Position(pair.x);
  precise vec3 velocity_difference = Velocity(pair.y) - Velocity(pair.x);
  vec3 d = AddScaled(position_difference, substep.interval, velocity_difference);
  float rest_length = ModelFloat(cloth.model.rest_lengths + constraint);
  if (!IsStretched(d, rest_length, cloth.step.shortest_sq, cloth.step.longest_sq)) return;
  FlagParticle(pair.x);
  FlagParticle(pair.y);
}

// Whether this cloth has the round; the tiled plan dispatches the rounds of all cloths.
bool IsRefinedIn(uint substep_index, uint sweep, uint refine_round) {
  return substep_index + 1u == cloth.step.substeps && sweep + 1u == cloth.step.max_iterations &&
         refine_round < cloth.step.refine_rounds;
}

bool IsAtFlag(uint constraint) {
  uvec2 pair = ConstraintPair(constraint);
  return IsFlagged(pair.x) || IsFlagged(pair.y);
}

// Moves the ends of a link so that it has its length at the end of the substep. It changes positions, not
// velocities, which would continue the move in the next step.
void RefineConstraint(uint constraint) {
  uvec2 pair = ConstraintPair(constraint);
  vec3 position_i = Position(pair.x);
  vec3 position_j = Position(pair.y);
  precise vec3 position_difference = position_j - position_i;
  precise vec3 velocity_difference = Velocity(pair.y) - Velocity(pair.x);
  DistanceError error =
      PredictDistanceError(position_difference, velocity_difference, substep.interval,
                           substep.inverse_interval, ModelFloat(cloth.model.rest_lengths + constraint), 0.0, 0.0);
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
  precise float move = Quotient(error.residual, inverse_mass_sum);
  precise float move_i = inverse_mass_i * move;
  precise float move_j = -(inverse_mass_j * move);
  if (inverse_mass_i != 0.0) SetPosition(pair.x, AddScaled(position_i, move_i, error.direction));
  if (inverse_mass_j != 0.0) SetPosition(pair.y, AddScaled(position_j, move_j, error.direction));
}
