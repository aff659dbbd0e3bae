// Ropes of bodies as pictures show them. Pure.
#pragma once

#include <span>
#include <vector>

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"

namespace drape {

// Capsules, part by part, straight whether taut or not. `motions`: one per collider.
std::vector<Collider> RopesOf(std::span<const Collider> colliders,
                              std::span<const RigidMotion> motions);

}  // namespace drape
