// Stage `solve_distance`. Needs the accessors of one plan.
#include "lib/direction.glsl"
#include "lib/distance.glsl"
#include "lib/inequality.glsl"
#include "stages/rest_length.glsl"
#include "stages/substep.glsl"

#if defined(HAS_COMPLIANCE) || defined(HAS_INEQUALITIES)
#define HAS_LAMBDA
#endif

// Solves distance constraint k and returns whether there was anything to solve. The colours give each
// free particle one writer; pins are only read.
bool SolveConstraint(uint k, bool is_first_sweep) {
  uvec2 pair = ConstraintPair(k);
  float rest_length = RestLength(k);
  float compliance = 0.0;
  float lambda = 0.0;
#ifdef HAS_COMPLIANCE
  compliance = ModelFloat(cloth.compliances + k);
#endif
#ifdef HAS_LAMBDA
  // With strips before, these have begun the sum.
#ifdef HAS_STRIPS
  is_first_sweep = false;
#endif
  if (is_first_sweep) {
    scratch[cloth.lambdas + k] = 0.0;
  } else {
    lambda = scratch[cloth.lambdas + k];
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
  if (!(abs(error.residual) > cloth.tolerance * rest_length)) return false;
#endif
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
  vec3 direction = error.direction;
#ifdef HAS_START_DIRECTIONS
  ImpulseLine line = BlendDirections(position_difference, error.direction, cloth.end_share);
  direction = line.direction;
  inverse_mass_sum = inverse_mass_sum * line.slope;
#endif
  float impulse =
      DistanceImpulse(error.residual, substep.inverse_interval, inverse_mass_sum, compliance);
#ifdef HAS_INEQUALITIES
  impulse = AdmissibleImpulse(models[cloth.kinds + k], lambda, impulse);
  if (impulse == 0.0) return false;  // slack
#endif
#ifdef HAS_LAMBDA
  precise float accumulated = lambda + impulse;
  scratch[cloth.lambdas + k] = accumulated;
#endif
  precise float change_i = -(inverse_mass_i * impulse);
  precise float change_j = inverse_mass_j * impulse;
  if (inverse_mass_i != 0.0) SetVelocity(pair.x, AddScaled(velocity_i, change_i, direction));
  if (inverse_mass_j != 0.0) SetVelocity(pair.y, AddScaled(velocity_j, change_j, direction));
  return true;
}

void SolveDistance(uint k, bool is_first_sweep) {
  if (SolveConstraint(k, is_first_sweep)) MarkChanged();
}
