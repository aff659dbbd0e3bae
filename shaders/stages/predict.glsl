// Stages `predict` and `integrate`. Need the accessors of one plan.
#include "lib/predict.glsl"
#include "lib/vector.glsl"

// What is constant over the substep: gravity, and with IN_FORCE the springs (Bender et al. 2009, eq. 1).
vec3 ConstantAcceleration(uint i) {
#ifdef SPRINGS_IN_FORCE
  precise vec3 acceleration =
      cloth.gravity.xyz + ScratchVector(cloth.spring_accelerations + 3u * i);
  return acceleration;
#else
  return cloth.gravity.xyz;
#endif
}

void PredictParticle(uint i) {
  if (InverseMass(i) == 0.0) return;  // pins: PredictPin
  SetVelocity(i, MeanVelocity(Velocity(i), ConstantAcceleration(i), cloth.half_h));
}

void PredictPin(uint k, uint substep) {
  uint i = models[cloth.pins + k];
  SetVelocity(i, PinVelocity(Position(i), PinTarget(k), cloth.substeps - substep, cloth.inverse_h));
}

// p += h u; v = u + a h/2, for pins v = u. Bender et al. 2009, section 3.1, eq. 1.
void IntegrateParticle(uint i) {
  vec3 u = Velocity(i);
  SetPosition(i, AddScaled(Position(i), cloth.h, u));
  if (InverseMass(i) == 0.0) return;
  SetVelocity(i, AddScaled(u, cloth.half_h, ConstantAcceleration(i)));
}

// At the end of the step a pin is where it was asked to be, to the bit.
void PlacePin(uint k) { SetPosition(models[cloth.pins + k], PinTarget(k)); }
