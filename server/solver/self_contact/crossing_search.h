// Edges that go through triangles, and what a report says of near pairs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_surface.h"

namespace drape::self_contact {

// A pair without a common vertex.
struct Crossing {
  uint32_t edge;      // of ContactSurface::edges
  uint32_t triangle;  // of ContactSurface::triangles
};

// All of them, exactly, always in the same order. `positions_m`: [particle_count], finite.
std::vector<Crossing> FindCrossings(const ContactSurface& surface,
                                    std::span<const Vector3d> positions_m);

// Pairs count as near up to this many thicknesses [-].
inline constexpr double kNearPairRatio = 1.25;

struct SelfContactMeasures {
  uint32_t near_pairs = 0;  // at least, where MostPatchPairs are exceeded
  double smallest_distance_m = std::numeric_limits<double>::infinity();
  uint32_t crossings = 0;
};

// For the report of each cloth, [member_count]; a pair of two cloths counts for both. Pairs that
// are as near in the rest shape do not count as near.
std::vector<SelfContactMeasures> MeasureSelfContacts(const ContactSurface& surface,
                                                     const Thicknesses<double>& thicknesses,
                                                     std::span<const Vector3d> positions_m);

}  // namespace drape::self_contact
