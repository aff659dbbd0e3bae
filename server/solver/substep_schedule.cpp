#include "server/solver/substep_schedule.h"

#include <algorithm>

namespace drape {

SubstepSchedule::SubstepSchedule(const StepSettings& settings, bool has_two_steps,
                                 bool has_twist_damping, uint32_t hinge_period, double link_lead)
    : has_two_steps_(has_two_steps),
      substeps_(settings.substeps),
      h_(settings.substep_s()),
      hinge_period_(hinge_period),
      link_lead_(link_lead) {
  if (!has_twist_damping) return;
  twist_period_ = std::min(kTwistPeriod, substeps_);
  // The twist of a single cell decreases by four shares.
  const double share = settings.twist_damping_per_s * h_ * twist_period_ / 4;
  twist_share_ = std::min(share, kMaxTwistShare);
}

Substep SubstepSchedule::operator[](uint32_t index) const {
  Substep substep = has_two_steps_ ? TwoStep(index) : OneStep(index);
  substep.is_last = index + 1 == size();
  substep.link_interval_s = (1 + link_lead_) * substep.interval_s;
  const bool is_twist_due = twist_period_ > 0 && (size() - 1 - index) % twist_period_ == 0;
  if (is_twist_due) substep.twist_share = twist_share_;
  substep.finds_hinges = index % hinge_period_ == 0;
  substep.hinge_lead_s = (std::min(hinge_period_, size() - index) - 1) * h_ / 2;
  return substep;
}

double SubstepSchedule::largest_force_interval_s2() const {
  double largest_s2 = 0;
  // All substeps but the first are alike in this.
  for (uint32_t index = 0; index < std::min(size(), 2u); ++index) {
    const Substep substep = (*this)[index];
    largest_s2 = std::max(largest_s2, substep.interval_s * substep.force_s());
  }
  return largest_s2;
}

Substep SubstepSchedule::OneStep(uint32_t index) const {
  const bool is_last = index + 1 == substeps_;
  return {.duration_s = h_,
          .interval_s = h_,
          .pin_shares = substeps_ - index,
          .kick_before_s = index == 0 ? h_ / 2 : 0,
          .kick_after_s = is_last ? h_ / 2 : h_};
}

Substep SubstepSchedule::TwoStep(uint32_t index) const {
  const bool is_first = index == 0;
  const double interval_s = is_first ? h_ / 2 : 2 * h_ / 3;
  return {.duration_s = h_,
          .interval_s = interval_s,
          .is_two_step = true,
          .lead_s = is_first ? h_ / 2 : 0,
          .pin_shares = substeps_ - index,
          .kick_within_s = is_first ? h_ : interval_s};
}

}  // namespace drape
