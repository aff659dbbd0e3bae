// Floats as unsigned integers of the same order, so that integer atomics find the smallest and the
// largest of them: the result does not depend on the order of the invocations. Not for NaN.
// Inverse: server/render/gl_draw/float_order.h.

uint OrderedBits(float value) {
  uint bits = floatBitsToUint(value);
  return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}
