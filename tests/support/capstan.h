// Chains that loads pull over a bar, and the load at which they slip; tested by
// tests/physics/capstan_test.cpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>

#include "tests/support/scenes.h"

namespace drape::test {

// A chain over a horizontal bar that turns by pi in `turns` equal corners and hangs down vertically
// on both sides, a load at either end. At a corner of angle d inside the chain the tensions S < T
// of its links act at d/2 from the tangent, so they press with (S + T) sin d/2 and pull with (T -
// S) cos d/2: it slips from T/S = (cos d/2 + mu sin d/2) / (cos d/2 - mu sin d/2) =: f on. The
// first and the last particle in contact are level with the axis, where the hanging link is
// tangential: together they are one more corner. With massless links the loads differ by f^turns.
struct CapstanBar {
  uint32_t turns = 6;
  uint32_t hanging = 1;  // links on either side
  double radius_m = 0.1;
  double direction = 0;  // of the bar, about y [rad]
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  double link_kg = 0;
  double light_kg = 1;
  double friction_static = 0.3;
  double dynamic = 1;  // of the static coefficient
  double time_step_s = 1.0 / 60;

  double corner() const { return std::numbers::pi / turns; }
  double AngleOf(uint32_t contact) const { return std::numbers::pi - contact * corner(); }
  double link_m() const;

  // The heavy load that static friction just holds: corner by corner, with the links' own weight,
  // which presses by its part along the normal (cos a, sin a) and pulls towards the heavy side by
  // m g cos a.
  double SlipLoad_kg() const;

  // How fast the chain starts where the heavy load is `share` of that one, at least: what is more
  // than static friction holds accelerates everything [m/s^2].
  double Acceleration(double share) const;

  // The last particle is the heavy load.
  Scene Loaded(double share, const StepSettings& settings) const;
};

}  // namespace drape::test
