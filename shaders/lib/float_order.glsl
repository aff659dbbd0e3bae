// Floats as unsigned integers of the same order, so that integer atomics find the smallest and the
// largest of them: the result does not depend on the order of the invocations. Not for NaN.
// The inverse for C++: server/render/gl_draw/float_order.h.
#ifndef DRAPE_LIB_FLOAT_ORDER_GLSL_
#define DRAPE_LIB_FLOAT_ORDER_GLSL_

uint OrderedBits(float value) {
  uint bits = floatBitsToUint(value);
  return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

float FloatFromOrderedBits(uint bits) {
  return uintBitsToFloat((bits & 0x80000000u) != 0u ? bits & 0x7fffffffu : ~bits);
}

#endif
