// Roots and quotients. GLSL lets drivers round them by up to 2.5 ulp, and hardware does: then a link of its exact length
// has an error, and programs differ in how a compiler joins a root with a division. CORRECTS_ROOTS: a step of Newton's
// method whose remainder is exact (fma) rounds them correctly; of roots all but very few that are nearly halfway between
// two numbers. Software renderers are exact. INJECTS_ROOT_ERRORS, for tests: off by -1 to +2 ulp before that.
#ifndef DRAPE_LIB_ROOTS_GLSL_
#define DRAPE_LIB_ROOTS_GLSL_

#ifdef INJECTS_ROOT_ERRORS
float AsDriversRound(float exact) {
  uint bits = floatBitsToUint(exact);
  bool is_normal = (bits & 0x7f800000u) != 0u && (bits & 0x7f800000u) != 0x7f800000u;
  return is_normal ? uintBitsToFloat(bits + (bits * 2654435769u >> 30) - 1u) : exact;
}
// The fma of software renderers rounds twice; products of floats are exact as doubles.
float MultiplyAdd(float a, float b, float c) {
  precise double sum = double(a) * double(b) + double(c);
  return float(sum);
}
#else
float AsDriversRound(float rounded) { return rounded; }
float MultiplyAdd(float a, float b, float c) {
  precise float sum = fma(a, b, c);
  return sum;
}
#endif

float Root(float x) {
#ifdef CORRECTS_ROOTS
  precise float inverse = AsDriversRound(inversesqrt(x));
  precise float root = x * inverse;
  precise float half_inverse = 0.5 * inverse;
  root = MultiplyAdd(MultiplyAdd(-root, root, x), half_inverse, root);
  return x == 0.0 ? 0.0 : root;  // NaN stays NaN
#else
  precise float root = AsDriversRound(sqrt(x));
  return root;
#endif
}

float Quotient(float a, float b) {
#ifdef CORRECTS_ROOTS
  precise float inverse = AsDriversRound(1.0 / b);
  precise float quotient = a * inverse;
  float corrected = MultiplyAdd(MultiplyAdd(-quotient, b, a), inverse, quotient);
  // Nearly halfway between two numbers the step may end below the nearest one: so for 1 / (1 - 2^-24), which pivots
  // often are.
  float above = uintBitsToFloat(floatBitsToUint(corrected) + 1u);
  bool is_above = abs(MultiplyAdd(-above, b, a)) < abs(MultiplyAdd(-corrected, b, a));
  return abs(quotient) < 1e38 ? (is_above ? above : corrected) : quotient;
#else
  precise float quotient = AsDriversRound(a / b);
  return quotient;
#endif
}

// Of a number that is neither so large nor so small that its reciprocal is out of range.
float Reciprocal(float x) {
#ifdef CORRECTS_ROOTS
  precise float inverse = AsDriversRound(1.0 / x);
  float corrected = MultiplyAdd(MultiplyAdd(-inverse, x, 1.0), inverse, inverse);
  float above = uintBitsToFloat(floatBitsToUint(corrected) + 1u);
  bool is_above = abs(MultiplyAdd(-above, x, 1.0)) < abs(MultiplyAdd(-corrected, x, 1.0));
  return is_above ? above : corrected;
#else
  precise float inverse = AsDriversRound(1.0 / x);
  return inverse;
#endif
}

vec3 Quotient(vec3 a, float b) { return vec3(Quotient(a.x, b), Quotient(a.y, b), Quotient(a.z, b)); }

#endif
