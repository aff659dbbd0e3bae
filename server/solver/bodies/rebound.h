// How fast what hits leaves (server/solver/method.md, "predict").
#pragma once

#include <algorithm>
#include <cmath>

#include "server/solver/bodies/body_numbers.h"

namespace drape::bodies {

// `speed`: along the outward normal, before the substep; `fall`: relative acceleration along it by
// gravity. 0 where that is no hit.
inline double ReboundSpeed(double gap, double speed, double fall, const BodyNumbers& numbers) {
  if (numbers.restitution == 0) return 0;
  const double approach = -speed;
  const double gained = -2 * fall * std::max(gap, 0.0);
  const double arrival = std::sqrt(std::max(approach * approach + gained, 0.0));
  const bool is_hit = std::min(arrival, 2 * approach) > numbers.slowest_rebound_m_per_s;
  return is_hit ? numbers.restitution * arrival : 0;
}

}  // namespace drape::bodies
