// Closed forms that several tests compare with. Header only.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

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

// The Laguerre polynomial L_n(x).
inline double Laguerre(uint32_t n, double x) {
  double before = 1, now = 1 - x;
  if (n == 0) return before;
  for (uint32_t k = 1; k < n; ++k) {
    before = std::exchange(now, ((2 * k + 1 - x) * now - k * before) / (k + 1));
  }
  return now;
}

// The n zeros of L_n, ascending, by bisection between changes of sign; they lie in (0, 4n). A chain
// of n equal links of length l with equal masses has the small modes w^2 = (g/l) z, in which the
// particle k links above the free end swings by L_k(z).
inline std::vector<double> LaguerreZeros(uint32_t n) {
  std::vector<double> zeros;
  constexpr double kGrid = 1e-3;
  for (double x = 0; x < 4 * n; x += kGrid) {
    double low = x, high = x + kGrid;
    if (Laguerre(n, low) * Laguerre(n, high) > 0) continue;
    for (int step = 0; step < 60; ++step) {
      const double middle = (low + high) / 2;
      (Laguerre(n, low) * Laguerre(n, middle) > 0 ? low : high) = middle;
    }
    zeros.push_back(low);
  }
  return zeros;
}

}  // namespace drape::test
