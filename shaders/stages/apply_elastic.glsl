// Stage `apply_elastic`. Two phases, so that all impulses come from the same velocities: the impulses of
// the elements, then the sums of the particles. Needs the accessors of one plan.
#include "stages/elastic_element.glsl"
#include "stages/kick.glsl"

// Of an element that acts along L [N s]; 0 if L has no direction.
vec3 ImpulseAlong(ElasticElement element, Differences d, float seconds) {
  vec3 l = WeightedSum(element.weights, d);
  float len = Length(l);
  if (len < MIN_DIRECTION_LENGTH) return vec3(0.0);
  float speed = 0.0;
  if (element.damping_share > 0.0) {
    uvec4 i = element.particles;
    Differences rates = DifferencesFrom(Velocity(i.x), Velocity(i.y), Velocity(i.z), Velocity(i.w));
    precise float speed_along = Dot(WeightedSum(element.weights, rates), l) / len;
    speed = speed_along;
  }
  precise float per_length = ElasticImpulse(element, len - element.rest_length, speed, seconds, cloth.step.h,
                                            cloth.step.inverse_h, cloth.step.max_elastic_frequency_sq) /
                             len;
  precise vec3 along = per_length * l;
  return along;
}

#ifdef HAS_HINGE_ANGLES
// Impulses on the second to fourth particle [N s].
Differences ElasticImpulses(ElasticElement element, Differences d, float seconds) {
  if (!ActsAlong(element)) {
    precise float gain =
        element.mass * min(element.frequency_sq, cloth.step.max_elastic_frequency_sq) * seconds;
    return HingeImpulses(element, d, gain);
  }
  vec3 along = ImpulseAlong(element, d, seconds);
  precise vec3 a = element.weights.x * along;
  precise vec3 b = element.weights.y * along;
  precise vec3 c = element.weights.z * along;
  return Differences(a, b, c);
}
#endif

// The impulses of element e [N s].
void StoreElasticImpulse(uint e, uint place, float seconds) {
  ElasticElement element = LoadElement(e);
  uvec4 i = element.particles;
  Differences d = DifferencesFrom(KickPosition(i.x, place), KickPosition(i.y, place),
                                  KickPosition(i.z, place), KickPosition(i.w, place));
#ifdef HAS_HINGE_ANGLES
  Differences on = ElasticImpulses(element, d, seconds);
  uint word = cloth.scratch.elastic_impulses + 12u * e;
  precise vec3 on_first = -(on.a + on.b + on.c);
  SetScratchVector(word, on_first);
  SetScratchVector(word + 3u, on.a);
  SetScratchVector(word + 6u, on.b);
  SetScratchVector(word + 9u, on.c);
#else
  SetScratchVector(cloth.scratch.elastic_impulses + 3u * e, ImpulseAlong(element, d, seconds));
#endif
}

// The impulses of the elements on i, in ascending order [N s].
vec3 ImpulseOfElements(uint i) {
  uint end = models[cloth.model.elastic_offsets + i + 1u];
  precise vec3 impulse = vec3(0.0);
  for (uint k = models[cloth.model.elastic_offsets + i]; k < end; ++k) {
    uint word = cloth.model.elastic_ends + DRAPE_ELASTIC_END_WORDS * k;
    impulse = AddScaled(impulse, ModelFloat(word + 1u),
                        ScratchVector(cloth.scratch.elastic_impulses + 3u * models[word]));
  }
  return impulse;
}

// w times those [m/s].
vec3 ChangeByElements(uint i) {
  precise vec3 change = InverseMass(i) * ImpulseOfElements(i);
  return change;
}

// Only their targets move pins.
void ApplyElasticImpulses(uint i) {
#ifdef HAS_IMPULSES
  if (InverseMass(i) == 0.0) Pull(i, ImpulseOfElements(i));
#endif
  if (InverseMass(i) == 0.0) return;
  SetVelocity(i, AddScaled(Velocity(i), 1.0, ChangeByElements(i)));
}
