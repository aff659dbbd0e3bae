// Sums in fixed point, so that integer atomics add up floats: the result does not depend on the order of the
// invocations. Each value is given as a share of a common bound, between -1 and 1; up to 65536 of them fit, and each
// is rounded down by at most 2^-29 of the bound.
#ifndef DRAPE_LIB_FIXED_SUM_GLSL_
#define DRAPE_LIB_FIXED_SUM_GLSL_

const float kFixedHigh = 16384.0;
const float kFixedLow = 32768.0;

// The two words that are added, each with wrapping integer sums.
uvec2 FixedWords(float share) {
  precise float scaled = share * kFixedHigh;
  float whole = floor(scaled);
  precise float rest = (scaled - whole) * kFixedLow;
  return uvec2(uint(int(whole)), uint(rest));
}

float FixedSum(uvec2 words) {
  precise float sum = float(int(words.x)) / kFixedHigh + float(words.y) / (kFixedHigh * kFixedLow);
  return sum;
}

#endif
