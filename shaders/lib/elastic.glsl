// Stage `apply_elastic`: elements of bending and shear (server/solver/method.md).
#ifndef DRAPE_LIB_ELASTIC_GLSL_
#define DRAPE_LIB_ELASTIC_GLSL_

#include "lib/vector.glsl"

// An element as the model has it: L = sum of weights times positions, at rest |L| = rest_length.
struct ElasticElement {
  uvec4 particles;
  vec3 weights;        // of the second to fourth particle [-]
  float rest_length;   // [m]
  float mass;          // of its oscillator, by its shares of the particles [kg]
  float frequency_sq;  // of that oscillator [1/s^2]
  float damping_share;  // 0 or 1 [-]
};

// Differences of four vectors from the first one.
struct Differences {
  vec3 a, b, c;
};

Differences DifferencesFrom(vec3 first, vec3 second, vec3 third, vec3 fourth) {
  precise vec3 a = second - first;
  precise vec3 b = third - first;
  precise vec3 c = fourth - first;
  return Differences(a, b, c);
}

vec3 WeightedSum(vec3 weights, Differences d) {
  precise vec3 sum = (weights.x * d.a + weights.y * d.b) + weights.z * d.c;
  return sum;
}

// |L| less the rest length [m]; of a hinge at rest at an angle |L| is negative on the other side.
float ElasticDeflection(vec3 l, Differences d, float rest_length) {
  precise vec3 across = d.c - d.b;
  precise float deflection =
      Length(l) - (Dot(l, Cross(d.a, across)) < 0.0 ? -rest_length : rest_length);
  return deflection;
}

// Impulse along L [N s] within `duration` [s], part of a substep h; `deflection` [m] from rest, at this speed
// [m/s].
float ElasticImpulse(ElasticElement element, float deflection, float speed, float duration, float h,
                     float inverse_h, float max_frequency_sq) {
  precise float ratio = min((h * h) * element.frequency_sq, MAX_ELASTIC_RATIO);
  precise float ratio_sq = ratio * ratio;
  precise float damping = element.damping_share * ratio_sq / (1.0 + ratio_sq) * inverse_h;
  precise float stiffness = min(element.frequency_sq, max_frequency_sq);
  precise float impulse = -(duration * element.mass) * (stiffness * deflection + damping * speed);
  return impulse;
}

#endif
