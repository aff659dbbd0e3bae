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

bool IsSpring(ElasticElement element) {
  return element.weights.y == 0.0 && element.weights.z == 0.0;
}

// Whether its impulses are along L.
bool ActsAlong(ElasticElement element) { return element.rest_length == 0.0 || IsSpring(element); }

// A hinge where its particles are (equation 15a). `across` is the side towards its fourth particle less that towards
// the third, each times its weight.
struct HingeShape {
  vec3 across, normal;
  float edge_sq, inverse_sq;
  float rest;      // normal times this: L at rest
  vec3 from_rest;  // L less that [m]
};

HingeShape ShapeOfHinge(vec3 weights, float rest_length, Differences d) {
  HingeShape shape;
  precise vec3 across = weights.y * d.b - weights.z * d.c;
  shape.across = across;
  shape.normal = Cross(d.a, across);
  shape.edge_sq = Dot(d.a, d.a);
  precise float blur_sq = 4.0 * HINGE_BLUR_SQ * shape.edge_sq * shape.edge_sq + LEAST_HINGE_AREA;
  precise float inverse_sq = 1.0 / (Dot(shape.normal, shape.normal) + blur_sq);
  shape.inverse_sq = inverse_sq;
  precise float rest = HINGE_NORMAL_SCALE * (rest_length * Root(inverse_sq));
  shape.rest = rest;
  precise vec3 from_rest = WeightedSum(weights, d) - rest * shape.normal;
  shape.from_rest = from_rest;
  return shape;
}

// How far an element is from rest [m].
float ElasticDeflection(ElasticElement element, Differences d) {
  if (!ActsAlong(element)) {
    return Length(ShapeOfHinge(element.weights, element.rest_length, d).from_rest);
  }
  precise float deflection = Length(WeightedSum(element.weights, d)) - element.rest_length;
  return deflection;
}

// Impulses on the second to fourth particle [N s] (equation 16a); `gain` is stiffness times duration [N s/m].
Differences HingeImpulses(ElasticElement element, Differences d, float gain) {
  HingeShape shape = ShapeOfHinge(element.weights, element.rest_length, d);
  precise float slope = Dot(shape.from_rest, shape.normal) * shape.inverse_sq;
  precise vec3 turn = shape.rest * (shape.from_rest - slope * shape.normal);
  precise vec3 impulse = -gain * shape.from_rest;
  precise vec3 on_edge =
      gain * (Cross(shape.across, turn) - (8.0 * HINGE_BLUR_SQ * shape.rest * slope * shape.edge_sq) * d.a);
  precise vec3 on_sides = gain * Cross(turn, d.a);
  precise vec3 a = element.weights.x * impulse + on_edge;
  precise vec3 b = element.weights.y * (impulse + on_sides);
  precise vec3 c = element.weights.z * (impulse - on_sides);
  return Differences(a, b, c);
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
