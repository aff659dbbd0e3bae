// Stage `refine` (server/solver/method.md, "refine"): which links are moved, for both paths.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/model/float_model.h"
#include "server/solver/solver_constants.h"
#include "server/solver/step_plan.h"

namespace drape::cpu {

// A link whose ends are moved, in some of the cloths of a group.
struct RefinedLink {
  uint32_t place;   // as FloatModel::constraint_places
  uint32_t cloths;  // one bit each
};

inline constexpr uint32_t kMostCloths = 32;  // that marks can tell apart

// Working memory of the stage; holds no marks between two uses.
class Refinement {
 public:
  // `model` must live until the end of the run.
  void Begin(const FloatModel& model);
  // The link at this place is stretched in these cloths, one bit each; not none.
  void Mark(uint32_t place, uint32_t cloths);
  // Rounds until no link is stretched, within the limits of `solver`: move(links) moves all links
  // at the ends of those that are, kRefineSweeps times in order of the colours; then another look,
  // stretched_in(place), at those whose ends may have been moved: the others are as they were.
  // Returns whether any were moved.
  template <class Move, class StretchedIn>
  bool Run(const SolverChoice& solver, const Move& move, const StretchedIn& stretched_in) {
    for (uint32_t round = 0; round < solver.refine_rounds; ++round) {
      const std::span<const RefinedLink> links = TakeLinks();
      if (links.empty()) return round > 0;
      move(links);
      if (round + 1 == solver.refine_rounds) break;
      const uint32_t going_on = ClothsGoingOn(links, solver.refine_solves);
      for (const auto& [place, cloths] : links) MarkSome(place, cloths & going_on);
      for (const auto& [place, cloths] : TakeLinks()) {
        MarkSome(place, cloths & stretched_in(place));
      }
    }
    return true;
  }

 private:
  // As Mark, but maybe none.
  void MarkSome(uint32_t place, uint32_t cloths) {
    if (cloths != 0) Mark(place, cloths);
  }
  void MarkEnd(uint32_t i, uint32_t cloths);
  // The links at marked particles, in order of the colours; valid until called again. Takes the
  // marks away.
  std::span<const RefinedLink> TakeLinks();
  // Counts what has been moved. The cloths that have not come to the limit.
  uint32_t ClothsGoingOn(std::span<const RefinedLink> moved, uint32_t solve_limit);

  const FloatModel* model_ = nullptr;
  std::array<uint32_t, kMostCloths> solves_{};  // of each cloth since Begin
  std::vector<uint32_t> marks_;                 // [particle_count] one bit for each cloth
  std::vector<uint32_t> particles_;             // that are marked
  std::vector<uint64_t> is_listed_;             // one bit for each place; 0 but within TakeLinks
  std::vector<RefinedLink> links_;
};

}  // namespace drape::cpu
