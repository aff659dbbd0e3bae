// Stages `predict` and `integrate`. Need the accessors of one plan.
#include "lib/predict.glsl"
#include "lib/two_step.glsl"
#include "lib/vector.glsl"
#include "stages/previous.glsl"
#include "stages/quiet_links.glsl"
#include "stages/rebound.glsl"
#include "stages/substep.glsl"

// The acceleration that is constant over the substep: gravity, and with IN_FORCE the springs (Bender et al.
// 2009, eq. 1).
vec3 ConstantAcceleration(uint i) {
#ifdef HAS_SPRING_FORCES
  precise vec3 acceleration =
      cloth.step.gravity.xyz + ScratchVector(cloth.scratch.spring_accelerations + 3u * i);
  return acceleration;
#else
  return cloth.step.gravity.xyz;
#endif
}

void PredictBallistic(uint i) {
  SetVelocity(i, MeanVelocity(Velocity(i), ConstantAcceleration(i), 0.5 * substep.interval));
}

#ifdef HAS_TWO_STEPS
// b = p + (p - p')/3; u = (v + (v - v')/3 + H g) / (1 + c H). In the first substep of a step, whose previous state is
// the present one, b = p + v h/2 and u = (v + h g) / (1 + c h). With remainders u makes up for what rounding takes
// from b; what rests on a collider has none.
void PredictTwoStep(uint i, bool rests) {
  vec3 p = Position(i);
  vec3 v = Velocity(i);
#ifdef HAS_REMAINDERS
  Remainders remainders = RemaindersOf(i);
  if (rests) remainders = NoRemainders();
  precise vec3 flight = (p - PreviousPosition(i)) * (1.0 / 3.0) + substep.lead * v;
  precise vec3 way = flight + Extrapolated(remainders.now, remainders.previous);
  precise vec3 base = p + way;
  precise vec3 rest = rests ? vec3(0.0) : way - (base - p);
  SetPosition(i, base);
  SetRemainders(i, Remainders(rest, remainders.now));
#else
  vec3 base = Extrapolated(p, PreviousPosition(i));
  SetPosition(i, AddScaled(base, substep.lead, v));
#endif
  vec3 ahead = Extrapolated(v, PreviousVelocity(i));
  precise vec3 u = AddScaled(ahead, substep.kick_within, cloth.step.gravity.xyz) * substep.damping_factor;
#ifdef HAS_REMAINDERS
  u = AddScaled(u, substep.inverse_interval, rest);
#endif
  SetVelocity(i, u);
  SetPrevious(i, p, v);
}
#endif

void PredictParticle(uint i) {
  bool is_pin = InverseMass(i) == 0.0;
  bool rests = false;
#ifdef HAS_QUIET_LINKS
  rests = !is_pin && RestsOnCollider(i);
  SetQuiet(i, rests);
#endif
  if (is_pin) return;  // PredictPin
#ifdef HAS_RESTITUTION
  StoreRebounds(i);
#endif
#ifdef HAS_TWO_STEPS
  if (IsTwoStep()) {
    PredictTwoStep(i, rests);
    return;
  }
#endif
  PredictBallistic(i);
}

void PredictPin(uint k) {
  uint i = PinParticle(k);
  if (IsOpen(i)) return;
  vec3 way = PinWay(Position(i), PinTarget(k), pin_shares);
  precise vec3 velocity = way * substep.inverse_duration;
  SetVelocity(i, velocity);
#ifdef HAS_TWO_STEPS
  SetPosition(i, AddScaled(Position(i), substep.pin_lead, way));
#endif
}

#ifdef HAS_REMAINDERS
void EndWithRemainder(uint i) {
  vec3 p = Position(i);
  vec3 u = Velocity(i);
  Remainders remainders = RemaindersOf(i);
  precise vec3 way = substep.interval * u;
  precise vec3 end = p + way;
  precise vec3 rest = way - (end - p);
  SetPosition(i, end);
  SetVelocity(i, AddScaled(u, -substep.inverse_interval, remainders.now));
  SetRemainders(i, Remainders(rest, remainders.previous));
}
#endif

// p = b + H u; v = u + a H/2, with two steps and for pins u. Bender et al. 2009, section 3.1, eq. 1.
void IntegrateParticle(uint i) {
  vec3 u = Velocity(i);
#ifdef HAS_REMAINDERS
  if (InverseMass(i) != 0.0) {
    EndWithRemainder(i);
    return;
  }
#endif
  SetPosition(i, AddScaled(Position(i), substep.interval, u));
  if (InverseMass(i) == 0.0 || IsTwoStep()) return;
  SetVelocity(i, AddScaled(u, 0.5 * substep.interval, ConstantAcceleration(i)));
}

// At the end of the step a pin is exactly at its target.
void PlacePin(uint k) {
  uint i = PinParticle(k);
  if (!IsOpen(i)) SetPosition(i, PinTarget(k));
}
