// Straight-line motion of a pin target over time. Pure.
#pragma once

#include <Eigen/Core>

namespace drape {

// From `start_m` at start_s to `target_m` at start_s + over_s; constant before and after. over_s =
// 0: the target applies from start_s on (the pin moves there within one step). Any one frame.
struct PinMotion {
  Eigen::Vector3d start_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  double start_s = 0;
  double over_s = 0;  // >= 0

  // At or after the end exactly target_m, bit for bit.
  Eigen::Vector3d At(double time_s) const;
  bool IsOver(double time_s) const { return time_s >= start_s + over_s; }
};

}  // namespace drape
