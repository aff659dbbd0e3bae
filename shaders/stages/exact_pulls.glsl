// Impulses on particles, mostly on what is held, by several invocations at a time: sums of vectors in whole
// multiples of 2^-64, which are exact, so that their order is not seen; smaller parts of each are dropped. Of kernels
// that count in Scratch.
#ifndef DRAPE_STAGES_EXACT_PULLS_GLSL_
#define DRAPE_STAGES_EXACT_PULLS_GLSL_

#include "stages/impulses.glsl"

#ifdef HAS_IMPULSES

const float kUnit = 4294967296.0;

// Of the number of three words, the lowest first.
uvec3 Negated(uvec3 words) {
  uint low = ~words.x + 1u;
  uint middle = ~words.y + (low == 0u ? 1u : 0u);
  uint high = ~words.z + (low == 0u && middle == 0u ? 1u : 0u);
  return uvec3(low, middle, high);
}

// Adds the number to the one of three words, the lowest first; negative ones wrap. Sums stay below 2^31.
void AddExactly(uint word, float value) {
  float size = abs(value);
  if (!(size < 2147483648.0)) return;  // a fault of the step, which tells no impulses
  float whole = floor(size);
  precise float middle = (size - whole) * kUnit;
  float middle_whole = floor(middle);
  precise float low = (middle - middle_whole) * kUnit;
  uvec3 words = uvec3(uint(floor(low)), uint(middle_whole), uint(whole));
  if (value < 0.0) words = Negated(words);
  uint before = atomicAdd(scratch_words[word], words.x);
  uint carry = before + words.x < before ? 1u : 0u;
  uint with_carry = words.y + carry;
  carry = with_carry < words.y ? 1u : 0u;
  before = atomicAdd(scratch_words[word + 1u], with_carry);
  if (before + with_carry < before) carry += 1u;
  atomicAdd(scratch_words[word + 2u], words.z + carry);
}

void AddExactly(uint word, vec3 vector) {
  AddExactly(word, vector.x);
  AddExactly(word + 3u, vector.y);
  AddExactly(word + 6u, vector.z);
}

// A sum, rounded.
float ExactNumber(uint word) {
  uvec3 words = uvec3(scratch_words[word], scratch_words[word + 1u], scratch_words[word + 2u]);
  bool is_negative = words.z >= 0x80000000u;
  if (is_negative) words = Negated(words);
  precise float size = float(words.z) + (float(words.y) + float(words.x) / kUnit) / kUnit;
  return is_negative ? -size : size;
}
vec3 ExactVector(uint word) { return vec3(ExactNumber(word), ExactNumber(word + 3u), ExactNumber(word + 6u)); }

uint ExactPullWord(uint i) { return ImpulseWord(DRAPE_IMPULSE_EXACT_PULLS) + DRAPE_EXACT_WORDS * i; }
uint ZonePullWord(uint zone) { return ImpulseWord(DRAPE_IMPULSE_ZONE_PULLS) + DRAPE_EXACT_WORDS * zone; }

// On particle i [N s]; the weight is that of the substep, or of its memory.
void PullExactly(uint i, float weight, vec3 impulse) {
  precise vec3 weighted = weight * impulse;
  AddExactly(ExactPullWord(i), weighted);
}

// Of a particle with the inverse mass w: whether somebody asks what pairs give to it.
bool IsTold(float w) { return w == 0.0 || ImpulseWord(DRAPE_IMPULSE_HAS_CONTACTS) != 0u; }

// What ApplyToVelocities gives to particles, and passes on to what is held.
void PullPair(uvec4 particles, vec4 weights, vec4 w, float weight, vec3 impulse) {
  if (IsTold(w.x)) PullExactly(particles.x, weight * weights.x, impulse);
  if (IsTold(w.y)) PullExactly(particles.y, weight * weights.y, impulse);
  if (IsTold(w.z)) PullExactly(particles.z, weight * weights.z, impulse);
  if (IsTold(w.w)) PullExactly(particles.w, weight * weights.w, impulse);
}
#endif
#endif
