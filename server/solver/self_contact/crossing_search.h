// Edges that go through triangles, and what a report says of near pairs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/search_budget.h"
#include "server/solver/step_report.h"

namespace drape::self_contact {

// A pair without a common vertex.
struct Crossing {
  uint32_t edge;      // of ContactSurface::edges
  uint32_t triangle;  // of ContactSurface::triangles
};

// All of them, exactly, always in the same order, however many. `positions_m`: [particle_count],
// finite.
std::vector<Crossing> FindCrossings(const ContactSurface& surface,
                                    std::span<const Vector3d> positions_m);

// Of each particle, whether it belongs to an edge or a triangle of a crossing; empty: nothing
// crosses. All particles, where that takes more than `budget`: of those nothing is known, and they
// are left alone like what crosses.
std::vector<bool> FlagCrossings(const ContactSurface& surface,
                                std::span<const Vector3d> positions_m, SearchBudget budget);
inline std::vector<bool> FlagCrossings(const ContactSurface& surface,
                                       std::span<const Vector3d> positions_m,
                                       Interruption* interruption = nullptr) {
  return FlagCrossings(surface, positions_m, ReportBudget(surface, interruption));
}

// Pairs count as near up to this many thicknesses [-].
inline constexpr double kNearPairRatio = 1.25;

struct SelfContactMeasures {
  // Where everything is in one place, what was found before the budget was spent.
  uint32_t near_pairs = 0;
  double smallest_distance_m = std::numeric_limits<double>::infinity();
  uint32_t crossings = 0;
};

// What a report says of them.
void Tell(const SelfContactMeasures& its, Measurements& measured);

// For the report of each cloth, [member_count]; a pair of two cloths counts for both. Pairs that
// are as near in the rest shape do not count as near.
std::vector<SelfContactMeasures> MeasureSelfContacts(const ContactSurface& surface,
                                                     const Thicknesses<double>& thicknesses,
                                                     std::span<const Vector3d> positions_m,
                                                     Interruption* interruption = nullptr);

}  // namespace drape::self_contact
