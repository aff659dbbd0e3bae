// Groups of constraints that share no particle (Bender et al. 2009, section 3.3, Algorithm 1).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/description.h"

namespace drape {

// Algorithm 1 read with "for all c2 in g" (as printed it gives one group per constraint): each
// constraint, in list order, enters the first colour in which neither of its particles occurs. One
// bit mask of used colours per particle makes it linear in the constraints instead of quadratic. A
// pin counts like any particle. At most 2 * max_degree - 1 colours. Returns the colour of each
// constraint, [constraint_count]. Every index must be < particle_count, and i != j.
std::vector<uint32_t> ColourConstraints(std::span<const DistanceConstraint> constraints,
                                        uint32_t particle_count);
std::vector<uint32_t> ColourJoints(std::span<const PointJoint> joints, uint32_t particle_count);

}  // namespace drape
