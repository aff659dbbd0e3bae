// Pairs that say nothing that another pair does not say better.
#pragma once

#include <span>

#include "server/solver/self_contact/contact_pair.h"
#include "server/solver/self_contact/contact_surface.h"

namespace drape::self_contact {

// Whether the nearest point of one of the two is an end of an edge, or on the border of a triangle.
template <class V>
inline bool IsAtBorder(const ContactPair<V>& pair) {
  return pair.weights[0] == 0 || pair.weights[1] == 0 || pair.weights[2] == 0 ||
         pair.weights[3] == 0;
}

// Whether a triangle beside that of the pair is nearer to the vertex. The normal of such a pair
// leans away from the surface: it would stop a layer that slides on another one at each edge.
template <class V>
bool IsCovered(const ContactSurface& surface, std::span<const V> positions,
               const ContactPair<V>& pair);

extern template bool IsCovered(const ContactSurface&, std::span<const Vector3f>,
                               const ContactPair<Vector3f>&);
extern template bool IsCovered(const ContactSurface&, std::span<const Vector3d>,
                               const ContactPair<Vector3d>&);

}  // namespace drape::self_contact
