// When the parts of a cloth that may touch a solid are looked at again.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace drape::surface_contact {

// Each part has up to three corners among some particles, which count their ways. It is looked at
// again when one of its corners may have come some way within a substep, or in a certain substep,
// whichever comes first. Nothing here depends on the order in which parts wait.
template <class Real>
class Wakes {
 public:
  static constexpr uint32_t kNever = UINT32_MAX;  // no substep
  using Corners = std::array<uint32_t, 3>;        // an edge has its second corner twice

  // From a search on: particles have come no way; parts wait for the ways that Wait tells.
  void Begin(uint32_t particle_count, std::vector<Corners> corners);

  const Corners& corners(size_t part) const { return corners_[part]; }
  // A particle has moved on by this [m].
  void Move(uint32_t particle, Real way) { ways_[particle] += way; }
  // How far the corners of a part have come, the farthest of them [m].
  Real WayOf(size_t part) const {
    const auto& [i, j, k] = corners_[part];
    return std::max({ways_[i], ways_[j], ways_[k]});
  }

  // The part is looked at when a corner may have come this much farther [m], or in that substep,
  // which is none before those that others wait for already.
  void Wait(size_t part, Real way, uint32_t substep = kNever);
  // It is looked at in the next substep.
  void LookAgain(size_t part);
  // The parts to look at in a substep in which particles may come as far as `expected` [m],
  // ascending; each has to Wait or LookAgain. Valid until called again.
  std::span<const uint32_t> FindDue(uint32_t substep, Real expected);
  // Whether the part may come near within a substep, as far as the last look can tell.
  bool MayBeNear(size_t part, Real expected) const {
    return substeps_[part] != kNever || wakes_[part] <= WayOf(part) + expected;
  }

 private:
  static constexpr Real kMost = std::numeric_limits<Real>::max();

  void Mark(uint32_t part) { is_due_[part / 64] |= uint64_t{1} << part % 64; }
  void LookAtPartsOf(uint32_t particle, Real reach);

  std::vector<Corners> corners_;    // of parts
  std::vector<Real> wakes_;         // of parts: looked at when a corner has come so far
  std::vector<uint32_t> substeps_;  // or in this substep; 0: in the next one
  std::vector<Real> ways_;          // of particles
  std::vector<Real> first_wakes_;   // of particles: no part wakes before
  std::vector<uint32_t> offsets_;   // of particles, into `parts_`
  std::vector<uint32_t> parts_;     // of each particle
  std::vector<uint32_t> again_;     // parts that are looked at in the next substep
  std::vector<std::pair<uint32_t, uint32_t>> timed_;  // substep, part; ascending
  size_t first_timed_ = 0;
  std::vector<uint64_t> is_due_;  // one bit for each part; 0 but within FindDue
  std::vector<uint32_t> due_;
};

extern template class Wakes<float>;
extern template class Wakes<double>;

}  // namespace drape::surface_contact
