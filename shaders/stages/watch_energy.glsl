// Stage `commit`: whether the step gave the cloth more energy than it may. A fixed number of sums, so that the result
// does not depend on the local size. Needs the accessors of one plan, and beside them ENERGY_SUMS, SetEnergySum,
// EnergySum and EndSumPhase.
#include "lib/energy_watch.glsl"
#include "lib/inequality.glsl"
#include "lib/measure.glsl"

// What is held and moved does work: then no gain counts. The sum of many is still a finite number.
const float kNoGain = -1.0e30;

bool IsMovedPin(uint k) {
  uint i = PinParticle(k);
  return !IsOpen(i) && PinTarget(k) != StateVector(cloth.positions + 3u * i);
}

// Kinetic energy at the start, and its change with that of the potential one [J], of the particles s,
// s + ENERGY_SUMS and so on.
vec2 EnergyChange(uint s) {
  precise vec2 change = vec2(0.0);
  for (uint i = s; i < cloth.particle_count; i += ENERGY_SUMS) {
    if (HeldInverseMass(i) == 0.0) continue;
    float mass = ModelFloat(cloth.model.masses + i);
    vec3 v = StateVector(cloth.velocities + 3u * i);
    precise vec3 v_change = Velocity(i) - v;
    precise vec3 p_change = Position(i) - StateVector(cloth.positions + 3u * i);
    change += vec2(KineticEnergy(mass, v), EnergyGain(mass, v, v_change, p_change, cloth.step.gravity.xyz));
  }
#ifdef HAS_PINS
  for (uint k = s; k < cloth.pin_count; k += ENERGY_SUMS) {
    if (IsMovedPin(k)) change.y = kNoGain;
  }
#endif
  return change;
}

#if defined(HAS_APPLY_ELASTIC) || defined(HAS_SOLVE_ELASTIC) || defined(HAS_SOLVE_HINGES)
#define STORES_IN_ELEMENTS
#include "stages/elastic_element.glsl"
#endif

#if defined(HAS_COMPLIANCE) || defined(HAS_JOINT_COMPLIANCE) || defined(STORES_IN_ELEMENTS)
#define STORES_ENERGY

vec3 DifferenceAtStart(uvec2 pair) {
  precise vec3 d = StateVector(cloth.positions + 3u * pair.y) - StateVector(cloth.positions + 3u * pair.x);
  return d;
}

vec3 DifferenceAtEnd(uvec2 pair) {
  precise vec3 d = Position(pair.y) - Position(pair.x);
  return d;
}

#ifdef STORES_IN_ELEMENTS
vec3 StartPosition(uint i) { return StateVector(cloth.positions + 3u * i); }

// As the element acts: softer if it is too fast for a substep.
vec2 ElementChange(uint e) {
  ElasticElement element = LoadElement(e);
  uvec4 i = element.particles;
  float stiffness = element.mass * min(element.frequency_sq, cloth.step.max_elastic_frequency_sq);
  Differences d =
      DifferencesFrom(StartPosition(i.x), StartPosition(i.y), StartPosition(i.z), StartPosition(i.w));
  float start = ElasticEnergy(stiffness, ElasticDeflection(element, d));
  d = DifferencesFrom(Position(i.x), Position(i.y), Position(i.z), Position(i.w));
  float end = ElasticEnergy(stiffness, ElasticDeflection(element, d));
  return vec2(start, end - start);
}
#endif

// Energy of the compliant links, joints and elastic elements s, s + ENERGY_SUMS and so on: at the start, and its
// change [J].
vec2 StoredChange(uint s) {
  precise vec2 change = vec2(0.0);
#ifdef HAS_COMPLIANCE
  for (uint k = s; k < cloth.constraint_count; k += ENERGY_SUMS) {
    float compliance = ModelFloat(cloth.model.compliances + k);
    if (compliance == 0.0) continue;
    uvec2 pair = ConstraintPair(k);
    float rest_length = ModelFloat(cloth.model.rest_lengths + k);
    uint kind = cloth.has_inequalities != 0u ? models[cloth.model.kinds + k] : DRAPE_KIND_EQUAL;
    float start = ElasticEnergy(1.0 / compliance, Violation(kind, Length(DifferenceAtStart(pair)) - rest_length));
    float end = ElasticEnergy(1.0 / compliance, Violation(kind, Length(DifferenceAtEnd(pair)) - rest_length));
    change += vec2(start, end - start);
  }
#endif
#ifdef HAS_JOINT_COMPLIANCE
  for (uint k = s; k < cloth.joint_count; k += ENERGY_SUMS) {
    float compliance = ModelFloat(cloth.model.joint_compliances + k);
    if (compliance == 0.0) continue;
    uint word = cloth.model.joint_pairs + 2u * k;
    uvec2 pair = uvec2(models[word], models[word + 1u]);
    float start = ElasticEnergy(1.0 / compliance, Length(DifferenceAtStart(pair)));
    float end = ElasticEnergy(1.0 / compliance, Length(DifferenceAtEnd(pair)));
    change += vec2(start, end - start);
  }
#endif
#ifdef STORES_IN_ELEMENTS
  for (uint e = s; e < cloth.elastic_count; e += ENERGY_SUMS) change += ElementChange(e);
#endif
  return change;
}
#endif

// Of all sums, by every invocation.
vec2 AddEnergySums() {
  EndSumPhase();
  precise vec2 total = vec2(0.0);
  for (uint s = 0u; s < ENERGY_SUMS; ++s) total += EnergySum(s);
  EndSumPhase();
  return total;
}

// The same in all invocations. In uniform control flow.
bool GainsEnergy() {
  for (uint s = gl_LocalInvocationID.x; s < ENERGY_SUMS; s += LOCAL_SIZE) SetEnergySum(s, EnergyChange(s));
  vec2 change = AddEnergySums();
  vec2 start = vec2(change.x, 0.0);
  bool exceeds = ExceedsEnergyLimit(change.y, start, cloth.step.energy_constant, cloth.step.energy_lag_root);
#ifdef STORES_ENERGY
  if (!exceeds && cloth.watches_stores == 0u) return false;
  for (uint s = gl_LocalInvocationID.x; s < ENERGY_SUMS; s += LOCAL_SIZE) SetEnergySum(s, StoredChange(s));
  vec2 stored = AddEnergySums();
  start.y = stored.x;
  return ExceedsEnergyLimit(change.y + stored.y, start, cloth.step.energy_constant, cloth.step.energy_lag_root);
#else
  return exceeds;
#endif
}
