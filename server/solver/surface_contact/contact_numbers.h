// The numbers of surface contacts, each with its meaning and the harm of a change; those that
// decide what edges touch are in solver/collider_contact.h.
#pragma once

#include <cstdint>

namespace drape::surface_contact {

// A dip of an edge between its ends of less than this share of a typical edge does not count [-].
// Larger: edges sink in by that much; smaller: edges of fine cloth on large balls cost time, and in
// single precision rounding makes dips.
inline constexpr double kLeastDip = 1e-4;
// A plane is used for this time [s], unless particles have moved farther than this share of a
// typical edge since [-]. Longer: what slides over a ball or an edge leaves it by what the planes
// turn meanwhile; shorter: time.
inline constexpr double kPlaneAge_s = 1.0 / 800;
inline constexpr double kPlaneTravel = 0.02;
// An edge that turns on while it is stopped may meet the solid elsewhere: it is stopped up to so
// many times in a sweep. More: time; fewer: bars get through folds.
inline constexpr int kMeetings = 3;
// What folds around something thin is pushed from both sides, each time by what the other side has
// pushed: where something may get across, contacts are solved up to so many times in a sweep.
// More: time; fewer: the folds close over bars.
inline constexpr int kPasses = 8;
// A search allows for this many times the way of the fastest particle in free fall until the end of
// the step [-], and for this share of a typical edge [-]. Larger: more candidates; smaller: more
// searches.
inline constexpr double kReach = 2;
inline constexpr double kReachMargin = 0.05;
// Without candidates it is looked every so many substeps how far particles have come.
inline constexpr uint32_t kLookEvery = 4;
// Edges are expected to be no longer than this many times their length at rest [-].
inline constexpr double kMostStretch = 1.5;
// What has sunk in is pushed out at most this fast [m/s]: slower than particles are
// (kMaxDepenetrationSpeed_m_per_s), for at the corners of a box it changes at once which triangle
// has sunk in and by how much. Larger: cloth around corners trembles; smaller: what was thrown in
// stays there for longer.
inline constexpr double kRecovery_m_per_s = 0.1;

}  // namespace drape::surface_contact
