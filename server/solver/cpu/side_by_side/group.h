// The cloths of a group and its working memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/solver/cpu/side_by_side/pin_lists.h"
#include "server/solver/cpu/simd/simd_memory.h"
#include "server/solver/cpu/step/collider_reach.h"
#include "server/solver/cpu/step/expected_flight.h"
#include "server/solver/cpu/step/refine.h"
#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Working memory of one step of a group; kept by a thread between steps only to save allocations.
struct GroupScratch {
  SimdMemory particles;       // [particle_count + 1] position, velocity
  SimdMemory previous;        // the same of the state before, two steps only
  SimdMemory remainders;      // [particle_count] ClothRemainders; with remainders only
  SimdMemory flight;          // [particle_count] expected position at the start, velocity
  SimdMemory pin_targets;     // [pin_count]
  PinLists pin_lists;         // these only if the cloths hold different particles (OwnPins)
  SimdMemory inverse_masses;  // [particle_count + 1]
  SimdMemory pins;            // [pin_lists.pin_count]
  SimdMemory spans;           // [strip_pairs]
  std::vector<uint32_t> unlike_elements;
  std::vector<uint32_t> own_elements;   // OwnPins::element_places
  SimdMemory element_numbers;           // [unlike_elements + 1]
  SimdMemory elastic_places;            // of lines
  SimdMemory elastic_numbers;           // their numbers that differ
  SimdMemory path_solution;             // of a pair of strips or lines of elastic elements
  SimdMemory end_directions;            // of its links; only with start directions
  SimdMemory distance_impulses;         // Lambda, [(group_count + 1) * kVec4Size] [N s]
  SimdMemory twists;                    // [two rows of cells][column]
  SimdMemory colliders;                 // [reaches[0].near]
  SimdMemory motions;                   // [reaches[0].near] of those that move
  std::vector<MovingSurface> surfaces;  // [motions][cloth] in the substep under way
  SimdMemory contacts;                  // [particle_count][reaches[0].near]
  SimdMemory quiet_round_offs;          // [particle_count + 1] [m]; only with quiet links
  SimdMemory accelerations;             // [particle_count] springs (+ gravity if IN_FORCE)
  SimdMemory impulses;                  // of elastic elements, cells or triangles [N s]
  SimdMemory predicted;                 // [particle_count + 1] positions for kicks within a substep
  SimdMemory hinge_changes;             // [particle_count] of velocities, of a stage or per second
  SimdMemory joint_impulses;            // Lambda, [joint_count] [N s]
  SimdMemory impulse_sums;              // GroupImpulses; these only where impulses are asked for
  std::vector<uint8_t> has_impulse_sum;
  std::vector<uint32_t> impulse_places;
  SimdMemory impulse_pivots;  // [reaches[0].near] [m]
  SimdMemory right_sides;     // of the longest line of elastic elements
  SimdMemory held_hinges;     // [GroupImpulses::held]
  Refinement refinement;
  SimdMemory mixed_links;           // of the refinement
  std::vector<FloatState> results;  // of each cloth
  // One per cloth. All have the same near colliders: those that any of the cloths can meet.
  std::vector<ColliderReach> reaches;
  std::vector<size_t> unfinished;  // cloths whose step is to be done again with all colliders
  uint64_t repeats = 0;            // how many steps of this thread were
};

// One cloth of a group.
struct GroupCloth {
  StepContext context;
  bool measure;
  FloatState& state;
  // Of a cloth that may touch itself, but is expected not to. All cloths of a group have one, or
  // none has; those that have hold the same particles.
  std::optional<ExpectedFlight> flight{};
  StepReport report{};
  bool has_gained_energy = false;  // not stepped: it is to be by StepCalmer
  bool must_be_alone = false;      // not stepped: it is to be by StepCloth
};

// Whether the cloths have one model.
inline bool HaveOneModel(std::span<const GroupCloth> cloths) {
  return std::ranges::all_of(cloths, [&](const GroupCloth& cloth) -> bool {
    return &cloth.context.model == &cloths[0].context.model;
  });
}
// Whether they hold the same particles, those of one model.
inline bool HoldTheSame(std::span<const GroupCloth> cloths) {
  return HaveOneModel(cloths) && std::ranges::none_of(cloths, [](const GroupCloth& cloth) -> bool {
           return cloth.context.held.has_grips;
         });
}

// Whether somebody asks for the impulses of one of them.
inline bool DoesAnyAsk(std::span<const GroupCloth> cloths) {
  return std::ranges::any_of(
      cloths, [](const GroupCloth& cloth) -> bool { return cloth.context.asks_for_impulses; });
}

}  // namespace drape::cpu
