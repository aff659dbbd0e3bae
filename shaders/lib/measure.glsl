// Stage `measure`: energies and strain of the committed state (server/solver/step_report.h).
#ifndef DRAPE_LIB_MEASURE_GLSL_
#define DRAPE_LIB_MEASURE_GLSL_

#include "lib/vector.glsl"

// m v^2 / 2 [J].
float KineticEnergy(float mass, vec3 v) {
  precise float energy = 0.5 * mass * Dot(v, v);
  return energy;
}

// -m g.p [J], zero at the cloth's origin.
float PotentialEnergy(float mass, vec3 gravity, vec3 p) {
  precise float energy = -(mass * Dot(gravity, p));
  return energy;
}

// k/2 (l - l0)^2 [J] for a spring of stiffness k; a compliant constraint has k = 1 / alpha.
float ElasticEnergy(float stiffness, float elongation) {
  precise float energy = 0.5 * stiffness * elongation * elongation;
  return energy;
}

#endif
