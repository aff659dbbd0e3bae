// The substeps of a step and how long everything acts in each: the one place for these facts.
#pragma once

#include <compare>
#include <cstdint>

#include "server/solver/step_settings.h"

namespace drape {

// Impulses are found for the end of the substep, predicted as q = b + H u, with
//   ballistic:  b = p, H = duration, u = v + a H/2; then p = q, v = u + a H/2
//   two steps:  b = p + (p - p')/3, H = 2/3 duration, u = (4 v - v')/3 + a H; then p = q, v = u
//   two steps begin:  b = p + v duration/2, H = duration/2, u = v + a duration; then p = q, v = u
// where p', v' are the previous state (backward differences of second order;
// server/solver/method.md).
struct Substep {
  double duration_s = 0;
  double interval_s = 0;  // H
  // Strips remove the errors that links would have after this time at the velocities u: H, or
  // longer, which damps what stretches them.
  double link_interval_s = 0;
  bool is_two_step = false;
  bool is_last = false;  // of its step
  // With two steps b is ahead by this time's way at the velocity v: in the first substep, which has
  // no previous state.
  double lead_s = 0;
  // Pins move by this part of the rest of their way: 1 / pin_shares.
  uint32_t pin_shares = 1;
  // How long the kicks (springs, air) act before the substep, after it, and, with two steps, on the
  // predicted velocities: as long as gravity does.
  double kick_before_s = 0;
  double kick_after_s = 0;
  double kick_within_s = 0;
  // Share of a cell's twist that each of its corners loses [-]; 0 = no `damp_twist` in this
  // substep.
  double twist_share = 0;
  // Where several substeps share the forces of hinges: whether they are found in this one, and how
  // far beyond its end the particles are predicted for them, to the mean time of those that share.
  bool finds_hinges = true;
  double hinge_lead_s = 0;

  // How long a constant force acts on u [s]: an impulse Lambda is the force Lambda / force_s().
  double force_s() const { return is_two_step ? kick_within_s : interval_s; }
};

// Substeps from one `damp_twist` to the next: running it more often gains nothing.
inline constexpr uint32_t kTwistPeriod = 4;
// Largest share: if all cells twist alternately, each particle loses 16 shares, so above 1/16 it
// would overshoot.
inline constexpr double kMaxTwistShare = 1.0 / 16;

// The substeps of one step: settings.substeps of them. Small; each is computed on request.
class SubstepSchedule {
 public:
  // `has_two_steps`, `hinge_period` and `link_lead` as in SolverChoice; `has_twist_damping`: the
  // cloth has cells to damp.
  SubstepSchedule(const StepSettings& settings, bool has_two_steps, bool has_twist_damping,
                  uint32_t hinge_period = 1, double link_lead = 0);

  bool has_two_steps() const { return has_two_steps_; }
  uint32_t size() const { return substeps_; }
  Substep operator[](uint32_t index) const;  // index < size()
  // The largest interval_s * force_s() of the substeps [s^2].
  double largest_force_interval_s2() const;

  friend auto operator<=>(const SubstepSchedule&, const SubstepSchedule&) = default;

 private:
  Substep OneStep(uint32_t index) const;
  Substep TwoStep(uint32_t index) const;

  bool has_two_steps_;
  uint32_t substeps_;
  double h_;  // of a whole substep [s]
  // Substeps from one `damp_twist` to the next, counted back from the last substep; 0: never.
  uint32_t twist_period_ = 0;
  double twist_share_ = 0;
  uint32_t hinge_period_;  // >= 1
  double link_lead_;       // [intervals], >= 0
};

}  // namespace drape
