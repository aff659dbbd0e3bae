#include "server/solver/cpu/alone/tethers.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// Four tethers along the start of the substep: `speeds` [m/s] are to be taken off their lengths,
// `n_end` are the directions at its end.
void PullAlongStarts(const StepContext& context, const TetherGroup& group, const LaneVectors& n_end,
                     Lanes speeds) {
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes start[kLaneCount];
  for (uint32_t k = 0; k < kLaneCount; ++k) start[k] = p[group.particle[k]] - p[group.pin[k]];
  const auto lines = BlendDirections(Transpose(start[0], start[1], start[2], start[3]), n_end,
                                     Splat(context.controls.end_share));
  const auto n = Transpose(lines.n);
  const Lanes scale = speeds / lines.slope;
  Lanes* const u = context.scratch.state.velocities.data();
  for (uint32_t k = 0; k < kLaneCount; ++k) u[group.particle[k]] -= scale[k] * n[k];
}

// Groups [begin, end).
void PullGroups(const StepContext& context, size_t begin, size_t end) {
  const float h = context.substep.interval;
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const u = context.scratch.state.velocities.data();
  for (size_t g = begin; g < end; ++g) {
    const TetherGroup& group = context.model.tethers[g];
    Lanes d[kLaneCount];
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      const uint32_t i = group.particle[k], pin = group.pin[k];
      d[k] = PredictedDifference(p[pin], p[i], u[pin], u[i], h);
    }
    const LaneVectors t = Transpose(d[0], d[1], d[2], d[3]);
    const Lanes length_sq = (t.x * t.x + t.y * t.y) + t.z * t.z;
    const LaneMask is_taut = length_sq > group.length * group.length;
    if (!IsAnyLaneSet(is_taut)) continue;
    const Lanes length = Sqrt(length_sq);
    const Lanes speed = TetherSpeed(length, group.length, context.substep.inverse_interval);
    if (context.controls.has_start_directions()) {
      PullAlongStarts(context, group, Directions(t, length), is_taut ? speed : Lanes{});
      continue;
    }
    const Lanes speed_per_length = is_taut ? speed / length : Lanes{};
    for (uint32_t k = 0; k < kLaneCount; ++k) u[group.particle[k]] -= speed_per_length[k] * d[k];
  }
}

}  // namespace

void PullBlocks(const StepContext& context, size_t begin, size_t end) {
  const std::vector<uint32_t>& offsets = context.model.tether_block_offsets;
  PullGroups(context, offsets[begin], offsets[end]);
}

void ApplyTethers(const StepContext& context) {
  if (context.model.tethers.empty()) return;
  const size_t blocks = context.model.tether_block_offsets.size() - 1;
  context.ForRanges(blocks, kBlockGrain,
                    [&](size_t begin, size_t end) { PullBlocks(context, begin, end); });
}

}  // namespace drape::cpu
