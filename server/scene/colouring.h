// Groups of constraints that share no particle (paper section 3.3, Algorithm 1).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/description.h"

namespace drape {

// Algorithm 1 read with "for all c2 in g" (as printed it gives one group per constraint): each
// constraint goes, in list order, into the first colour in which neither of its particles occurs. Done
// with one bit mask of used colours per particle, so linear in the constraints instead of quadratic.
// At most 2 * max_degree - 1 colours. Returns the colour of each constraint.
// `shared_particles_ignored[p]` true = particle p never conflicts (pins are only read); may be empty.
std::vector<uint32_t> ColourConstraints(std::span<const DistanceConstraint> constraints,
                                        uint32_t particle_count,
                                        const std::vector<bool>& shared_particles_ignored);

}  // namespace drape
