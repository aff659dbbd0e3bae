// The choice of the cloths of a batch that are stepped side by side (group_step.h).
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/model/float_model.h"

namespace drape::cpu {

// Cloths with equal keys may form a group (side_by_side/lanes.md): the same stages run for all of
// them.
struct LaneKey {
  // `moves`: its colliders do.
  LaneKey(const FloatModel& model, const FloatControls& controls, uint32_t max_iterations,
          bool moves);

  const FloatModel* layout;  // FloatModel::layout; the cloths may differ in what is pinned
  StageSet stages;
  SolverChoice
      solver;  // end_share: 0 with start directions, else 1; span_give: 0; cloths may differ
  SubstepSchedule schedule;
  double tolerance;
  uint32_t max_iterations;
  std::string colliders;  // their kinds
  bool have_motions;
  // Where cloths touch themselves they must hold the same (ExpectedFlight): the model; else null.
  const FloatModel* touching_model;

  friend auto operator<=>(const LaneKey&, const LaneKey&) = default;
};

// Cloths that one task steps: in lanes if they are several, else alone.
using StepGroup = std::vector<uint32_t>;

// Fewer than this are stepped alone: a group takes about as long as 3 to 5 cloths alone, however
// few it has (tests/bench/notes/cpu.md).
constexpr uint32_t MinGroupSize(uint32_t lane_count) {
  return lane_count < 16 ? 4 : 5;
}

// One cloth of a batch.
struct GroupCandidate {
  const FloatModel* model;
  std::optional<LaneKey> key;  // none: it is to be stepped alone
  bool has_grips = false;
  bool asks_for_impulses = false;
};

// Divides a batch. A group has at most lane_count cloths, and fewer where that leaves every thread
// one. Every cloth is in one group. Large groups come first. Groups whose cloths all hold the same,
// those of one model without grips, are the cheapest, and those of which none asks for impulses:
// the cloths that need others are in as few groups as possible.
std::vector<StepGroup> FormGroups(std::span<const GroupCandidate> batch, uint32_t lane_count,
                                  uint32_t thread_count);

}  // namespace drape::cpu
