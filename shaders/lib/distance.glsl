// Stage `solve_distance`: the impulse of one distance constraint.
#ifndef DRAPE_LIB_DISTANCE_GLSL_
#define DRAPE_LIB_DISTANCE_GLSL_

#include "lib/vector.glsl"

struct DistanceError {
  vec3 direction;   // n, unit, from i to j at the predicted positions
  float residual;   // r = C + (alpha/h) Lambda [m]
};

// r = C + (alpha/h) Lambda [m], the accumulated impulse included, so that the elongation of a compliant
// constraint does not depend on the number of sweeps.
float SoftenedResidual(float error, float compliance, float inverse_h, float lambda) {
  precise float residual = error + compliance * inverse_h * lambda;
  return residual;
}

// The predicted error of a link that does not pull what friction holds (server/solver/method.md, "Quiet links")
// [m]: 0 where only rounding separates it from its length before the substep, plus what the substep changes, with all
// its digits. `start`: the difference of the old positions, `round_off` that of its length.
float QuietError(vec3 start, vec3 velocity_difference, float h, float rest_length, float round_off) {
  precise vec3 move = h * velocity_difference;
  precise vec3 end = start + move;
  precise float before = Dot(start, start) - rest_length * rest_length;
  precise float limit = (rest_length + rest_length) * round_off;
  precise vec3 sum = start + end;
  precise float left = before - clamp(before, -limit, limit);
  precise float error = (left + Dot(sum, move)) / (Length(end) + rest_length);
  return error;
}

// The predicted difference of positions is that of the old positions plus h times that of the mean
// velocities. Bender et al. 2009, section 3.2. [m], [m/s], [m], [m/N], [N s].
DistanceError PredictDistanceError(vec3 position_difference, vec3 velocity_difference, float h,
                                   float inverse_h, float rest_length, float compliance,
                                   float lambda) {
  vec3 d = AddScaled(position_difference, h, velocity_difference);
  float length_d = Length(d);
  DistanceError error;
  error.direction = Direction(d, length_d, vec3(1.0, 0.0, 0.0));
  precise float residual = length_d - rest_length;
#ifdef HAS_COMPLIANCE
  residual = SoftenedResidual(residual, compliance, inverse_h, lambda);
#endif
  error.residual = residual;
  return error;
}

// Whether a constraint whose ends will differ by d [m] is strained from its rest length [m] by more than a strain,
// given as `shortest_sq` = (1 - strain)^2 and `longest_sq` = (1 + strain)^2 [-].
bool IsStretched(vec3 d, float rest_length, float shortest_sq, float longest_sq) {
  float length_sq = Dot(d, d);
  precise float rest_length_sq = rest_length * rest_length;
  precise float shortest = shortest_sq * rest_length_sq;
  precise float longest = longest_sq * rest_length_sq;
  return length_sq < shortest || length_sq > longest;
}

// Delta Lambda = -r / h / (w_i + w_j + alpha/h^2) [N s]; negative pulls the particles together.
// Bender et al. 2009, section 3.2, with the compliance of server/solver/method.md.
float DistanceImpulse(float residual, float inverse_h, float inverse_mass_sum, float compliance) {
#ifdef HAS_COMPLIANCE
  precise float denominator = inverse_mass_sum + compliance * inverse_h * inverse_h;
#else
  precise float denominator = inverse_mass_sum;
#endif
  precise float wanted = -(residual * inverse_h);
  return Quotient(wanted, denominator);
}

#endif
