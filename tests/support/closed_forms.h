// Closed forms that several tests compare with. Header only.
#pragma once

#include <cmath>
#include <numbers>

namespace drape::test {

// For a, b > 0; converges quadratically.
inline double ArithmeticGeometricMean(double a, double b) {
  while (std::abs(a - b) > 1e-15 * a) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return a;
}

// The exact period of a rigid pendulum let go at the angle, 2 pi sqrt(L/g) / AGM(1, cos(angle/2))
// (Gauss's form of the complete elliptic integral).
inline double PendulumPeriod_s(double length_m, double gravity_m_per_s2, double angle_rad) {
  return 2 * std::numbers::pi * std::sqrt(length_m / gravity_m_per_s2) /
         ArithmeticGeometricMean(1, std::cos(angle_rad / 2));
}

}  // namespace drape::test
