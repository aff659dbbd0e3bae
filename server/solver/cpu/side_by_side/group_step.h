// The step of several cloths of one model at once, a lane of the vector registers per cloth. Each
// gets the operations of StepCloth in the same order, and so the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/side_by_side/group.h"

namespace drape::cpu {

// The vector instructions of this machine.
struct LaneSupport {
  uint32_t lane_count;  // cloths that one group may have; 1: none that is worth it
  std::string name;     // "AVX3" (AVX-512), "AVX2", ...
};
LaneSupport SupportedLanes();

// Limits of a cloth in lanes. With 16 lanes the working memory of a thread takes about 1.3 KiB per
// particle and 384 bytes per particle and collider. Larger cloths keep a thread busy alone.
inline constexpr size_t kMaxLaneParticles = size_t{1} << 16;
inline constexpr size_t kMaxLaneContacts = size_t{1} << 18;  // particles * colliders

// Whether a cloth with these parameters can be stepped in lanes: it is not too large, and has
// nothing that only StepCloth knows.
bool FitsLanes(const FloatModel& model, const FloatControls& controls);
// Steps every cloth once as StepCloth does, but for those that have gained energy
// (GroupCloth::has_gained_energy) or must be stepped alone (must_be_alone). At most
// lane_count cloths, all of them fit for lanes pairwise alike (LaneKey); numbers may differ.
// Thread-safe for different cloths and working memory.
void StepCloths(std::span<GroupCloth> cloths, GroupScratch& scratch);

}  // namespace drape::cpu
