#include "server/solver/cpu/step/step_context.h"

#include <cmath>

namespace drape::cpu {

bool HasRemainders(const SolverChoice& solver, const FloatState& state) {
  if (solver.always_has_remainders()) return true;
  const auto largest = static_cast<float>(solver.remainder_speed_m_per_s);
  return largest > 0 && std::ranges::none_of(state.velocities, [largest](const Vec4& v) {
           return Dot(v, v) > largest * largest;
         });
}

FloatSubstep::FloatSubstep(const Substep& substep, double damping_per_s)
    : interval(static_cast<float>(substep.interval_s)),
      half_interval(0.5f * interval),
      inverse_interval(static_cast<float>(1 / substep.interval_s)),
      link_interval(static_cast<float>(substep.link_interval_s)),
      inverse_link_interval(static_cast<float>(1 / substep.link_interval_s)),
      force_time(static_cast<float>(substep.force_s())),
      inverse_force_time(static_cast<float>(1 / substep.force_s())),
      is_two_step(substep.is_two_step),
      is_last(substep.is_last),
      pin_shares(static_cast<float>(substep.pin_shares)),
      inverse_duration(static_cast<float>(1 / substep.duration_s)),
      pin_lead(static_cast<float>(1 - substep.interval_s / substep.duration_s)),
      kick_before(static_cast<float>(substep.kick_before_s)),
      kick_after(static_cast<float>(substep.kick_after_s)),
      kick_within(static_cast<float>(substep.kick_within_s)),
      lead(static_cast<float>(substep.lead_s)),
      twist_share(static_cast<float>(substep.twist_share)),
      finds_hinges(substep.finds_hinges),
      hinge_interval(static_cast<float>(substep.interval_s + substep.hinge_lead_s)),
      damping_factor(static_cast<float>(substep.is_two_step
                                            ? 1 / (1 + damping_per_s * substep.kick_within_s)
                                            : std::exp(-damping_per_s * substep.interval_s))) {}

void GridElasticScratch::Prepare(const GridElements& grid, size_t members) {
  const size_t of_row = size_t{3} * grid.pitch;
  const size_t of_particles = grid.rows * of_row;
  forces_of_member = kAllKeptRows * of_row + kVec8Size;
  memory.assign(kVec8Size + 2 * of_particles + members * forces_of_member + kVec8Size, 0.0f);
  positions = memory.data() + kVec8Size;
  velocities = positions + of_particles;
  forces = velocities + of_particles + kVec8Size;
}

}  // namespace drape::cpu
