// Stage `refine` (server/solver/README.md, "Refinement"): which links are solved again, for both
// paths.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/float_model.h"

namespace drape::cpu {

// What a link's squared length is compared with, relative to the square of its rest length.
struct RefineLimits {
  explicit RefineLimits(double strain)
      : min_sq(static_cast<float>((1 - strain) * (1 - strain))),
        max_sq(static_cast<float>((1 + strain) * (1 + strain))) {}

  float min_sq;
  float max_sq;
};

struct LinkEnds {
  uint32_t from;
  uint32_t to;
};

// A link that is solved again, in some of the cloths of a group.
struct RefinedLink {
  uint32_t place;   // as FloatModel::constraint_places
  uint32_t cloths;  // one bit each
};

// Working memory of the stage; holds no marks between two uses.
class Refinement {
 public:
  void Begin(uint32_t particle_count);
  // The link between these particles is far off in these cloths, one bit each; not none.
  void Mark(uint32_t i, uint32_t j, uint32_t cloths) {
    MarkEnd(i, cloths);
    MarkEnd(j, cloths);
  }
  // The links at the ends of those that are far off, in order of the colours. Takes the marks away.
  std::span<const RefinedLink> TakeLinks(const FloatModel& model);

 private:
  void MarkEnd(uint32_t i, uint32_t cloths) {
    if (far_off_[i] == 0) particles_.push_back(i);
    far_off_[i] |= cloths;
  }

  std::vector<uint32_t> far_off_;    // [particle_count]
  std::vector<uint32_t> particles_;  // whose far_off_ is not 0
  std::vector<RefinedLink> links_;
};

}  // namespace drape::cpu
