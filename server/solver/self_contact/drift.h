// How far particles are from where they were expected, relative to each other.
#pragma once

#include <span>

#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// The diagonal of the box of (p - q) - t v over all particles [m]; infinite if any number is not
// finite. `found_positions` q and `found_velocities` v have as many elements, `positions` p may
// have more. The same bits on every processor.
template <class V>
ScalarOf<V> DriftOf(std::span<const V> positions, std::span<const V> found_positions,
                    std::span<const V> found_velocities, ScalarOf<V> time);

extern template float DriftOf<Vector3f>(std::span<const Vector3f>, std::span<const Vector3f>,
                                        std::span<const Vector3f>, float);
extern template double DriftOf<Vector3d>(std::span<const Vector3d>, std::span<const Vector3d>,
                                         std::span<const Vector3d>, double);

}  // namespace drape::self_contact
