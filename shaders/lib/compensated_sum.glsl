// Sums of many floats whose error does not grow with their number (Neumaier 1974).
#ifndef DRAPE_LIB_COMPENSATED_SUM_GLSL_
#define DRAPE_LIB_COMPENSATED_SUM_GLSL_

const float kLargestFloat = 3.402823e38;

// x: the sum so far, y: the part lost by rounding. The sum is x + y.
vec2 AddCompensated(vec2 sum, float value) {
  precise float total = sum.x + value;
  if (abs(total) > kLargestFloat) return vec2(total, 0.0);  // what it lacks would be no number
  precise float from_sum = (sum.x - total) + value;
  precise float from_value = (value - total) + sum.x;
  precise float lost = sum.y + (abs(sum.x) >= abs(value) ? from_sum : from_value);
  return vec2(total, lost);
}

#endif
