// Stage `solve_distance`. Needs the accessors of one plan.
#include "lib/direction.glsl"
#include "lib/distance.glsl"
#include "lib/inequality.glsl"
#include "stages/rest_length.glsl"
#include "stages/substep.glsl"

#if defined(HAS_COMPLIANCE) || defined(HAS_INEQUALITIES)
#define KEEPS_LAMBDAS
#endif

// Distance constraint k. The colours give each free particle one writer; pins are only read.
void SolveConstraint(uint k, bool is_first_sweep) {
  uvec2 pair = ConstraintPair(k);
  float rest_length = RestLength(k);
  float compliance = 0.0;
  float lambda = 0.0;
#ifdef HAS_COMPLIANCE
  compliance = ModelFloat(cloth.model.compliances + k);
#endif
#ifdef KEEPS_LAMBDAS
  if (is_first_sweep) {
    scratch[cloth.scratch.lambdas + k] = 0.0;
  } else {
    lambda = scratch[cloth.scratch.lambdas + k];
  }
#endif
  vec3 velocity_i = Velocity(pair.x);
  vec3 velocity_j = Velocity(pair.y);
  precise vec3 position_difference = Position(pair.y) - Position(pair.x);
  precise vec3 velocity_difference = velocity_j - velocity_i;
  DistanceError error =
      PredictDistanceError(position_difference, velocity_difference, substep.interval,
                           substep.inverse_interval, rest_length, compliance, lambda);
#ifdef HAS_TOLERANCE
  if (!(abs(error.residual) > cloth.step.tolerance * rest_length)) return;
#endif
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
#ifdef HAS_GRIPS
  if (inverse_mass_sum == 0.0) return;
#endif
  vec3 direction = error.direction;
#ifdef HAS_START_DIRECTIONS
  ImpulseLine line = BlendDirections(position_difference, error.direction, cloth.step.end_share);
  direction = line.direction;
  inverse_mass_sum = inverse_mass_sum * line.slope;
#endif
  float impulse =
      DistanceImpulse(error.residual, substep.inverse_interval, inverse_mass_sum, compliance);
#ifdef HAS_INEQUALITIES
  impulse = ClampImpulse(models[cloth.model.kinds + k], lambda, impulse);
  if (impulse == 0.0) return;  // slack
#endif
#ifdef KEEPS_LAMBDAS
  precise float accumulated = lambda + impulse;
  scratch[cloth.scratch.lambdas + k] = accumulated;
#endif
#ifdef HAS_IMPULSES
  precise vec3 pull = impulse * direction;
  if (PullsOnHeld(inverse_mass_i, inverse_mass_j)) PullAtConstraint(k, pull);
#endif
  precise float change_i = -(inverse_mass_i * impulse);
  precise float change_j = inverse_mass_j * impulse;
  if (inverse_mass_i != 0.0) SetVelocity(pair.x, AddScaled(velocity_i, change_i, direction));
  if (inverse_mass_j != 0.0) SetVelocity(pair.y, AddScaled(velocity_j, change_j, direction));
  MarkChanged();
}
