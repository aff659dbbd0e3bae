// The step of several cloths of one model at once, a lane of the vector registers per cloth. Each
// gets the operations of StepCloth in the same order, and so the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/solver/cpu/simd/simd_memory.h"
#include "server/solver/cpu/step/collider_reach.h"
#include "server/solver/cpu/step/step_context.h"
#include "server/solver/step_report.h"

namespace drape::cpu {

// Working memory of one step of a group; kept by a thread between steps only to save allocations.
struct GroupScratch {
  SimdMemory particles;          // [particle_count + 1] position, velocity
  SimdMemory previous;           // the same of the state before, two steps only
  SimdMemory pin_targets;        // [pin_count]
  SimdMemory strip_links;        // of a pair of strips
  SimdMemory end_directions;     // of its links; only with start directions
  SimdMemory distance_impulses;  // Lambda, [(group_count + 1) * kVec4Size] [N s]
  SimdMemory twists;             // [two rows of cells][column]
  SimdMemory colliders;          // [reaches[0].near]
  SimdMemory contacts;           // [particle_count][reaches[0].near]
  SimdMemory accelerations;      // [particle_count] springs (+ gravity if IN_FORCE)
  SimdMemory impulses;           // [element_count] or [triangle_count] [N s]
  SimdMemory predicted;          // [particle_count + 1] positions for kicks within a substep
  SimdMemory joint_impulses;     // Lambda, [joint_count] [N s]
  Refinement refinement;
  std::vector<FloatState> results;  // of each cloth
  // Of each cloth. All have the same colliders near: those that one of them can meet.
  std::vector<ColliderReach> reaches;
  std::vector<size_t> unfinished;  // cloths whose step is to be done again with all colliders
  uint64_t repeats = 0;            // how many steps of this thread were
};

// One cloth of a group.
struct GroupCloth {
  StepContext context;
  bool measure;
  FloatState& state;
  StepReport report{};
};

// The vector instructions of this machine.
struct LaneSupport {
  uint32_t lane_count;  // cloths that one group may have; 1: none that is worth it
  std::string name;     // "AVX3" (AVX-512), "AVX2", ...
};
LaneSupport SupportedLanes();

// Of a cloth in lanes: the working memory of a thread holds about 1.3 KiB per particle and 384
// bytes per particle and collider, with 16 lanes; larger cloths fill a thread's time alone.
inline constexpr size_t kMaxLaneParticles = size_t{1} << 16;
inline constexpr size_t kMaxLaneContacts = size_t{1} << 18;  // particles * colliders

// Whether a cloth with these parameters can be stepped in lanes: it is not too large, and has
// nothing that only StepCloth knows.
bool FitsLanes(const FloatModel& model, const FloatControls& controls);
// Steps every cloth once as StepCloth does. At most lane_count cloths, all of them fit for lanes
// and pairwise alike in model, schedule, solver, tolerance, max_iterations, use of tethers and of
// start directions; numbers may differ. Thread-safe for different cloths and working memory.
void StepCloths(std::span<GroupCloth> cloths, GroupScratch& scratch);

}  // namespace drape::cpu
