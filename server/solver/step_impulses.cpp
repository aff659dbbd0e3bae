#include "server/solver/step_impulses.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace drape {

void SortContacts(std::vector<ParticleImpulse>& contacts) {
  std::ranges::sort(contacts, {}, [](const ParticleImpulse& contact) {
    return std::pair(contact.particle, contact.collider);
  });
}

ImpulseWeights ImpulseWeightsOf(const SubstepSchedule& schedule, uint32_t index,
                                double damping_per_s) {
  const Substep substep = schedule[index];
  if (!substep.is_two_step) return {};
  // 1 + 1/3 + 1/9 + ... of this substep and those after it.
  const double reach = 1.5 * (1 - std::pow(3.0, -static_cast<double>(schedule.size() - index)));
  return {.impulse = reach * (1 + damping_per_s * substep.force_s()), .memory = reach - 1};
}

}  // namespace drape
