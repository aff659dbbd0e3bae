#include "server/solver/cpu/alone/tethers.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// Particles of tethers are free but for what is gripped.
bool MayPull(const StepContext& context, uint32_t i) {
  return !context.held.has_grips || context.held.IsFree(i);
}

// Tether k of group g changes its particle's velocity by -change; somebody asks for impulses.
void PullBothEnds(const StepContext& context, size_t g, uint32_t k, Vec4 change) {
  const uint32_t i = context.model.tethers[g].particle[k];
  if (!context.held.IsFree(i)) return;
  Vec4& u = context.scratch.state.velocities[i];
  const Vec4 before = u;
  u -= change;
  context.impulses()->PullAtTether(g * kVec4Size + k, context.model.free_masses[i] * (before - u));
}

// Four tethers along the start of the substep: `speeds` [m/s] are to be taken off their lengths,
// `n_end` are the directions at its end.
template <bool kAsks>
void PullAlongStarts(const StepContext& context, size_t g, const Vectors4& n_end, Vec4 speeds) {
  const TetherGroup& group = context.model.tethers[g];
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4 start[kVec4Size];
  for (uint32_t k = 0; k < kVec4Size; ++k) start[k] = p[group.particle[k]] - p[group.pin[k]];
  const auto lines = BlendDirections(Transpose(start[0], start[1], start[2], start[3]), n_end,
                                     Splat(context.controls.end_share));
  const auto n = Transpose(lines.n);
  const Vec4 scale = speeds / lines.slope;
  Vec4* const u = context.scratch.state.velocities.data();
  for (uint32_t k = 0; k < kVec4Size; ++k) {
    if constexpr (kAsks) {
      PullBothEnds(context, g, k, scale[k] * n[k]);
    } else if (MayPull(context, group.particle[k])) {
      u[group.particle[k]] -= scale[k] * n[k];
    }
  }
}

// Groups [begin, end).
template <bool kAsks>
void PullGroups(const StepContext& context, size_t begin, size_t end) {
  const float h = context.substep.interval;
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4* const u = context.scratch.state.velocities.data();
  for (size_t g = begin; g < end; ++g) {
    const TetherGroup& group = context.model.tethers[g];
    Vec4 d[kVec4Size];
#pragma GCC unroll 4  // so that they stay in registers
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const uint32_t i = group.particle[k], pin = group.pin[k];
      d[k] = PredictedDifference(p[pin], p[i], u[pin], u[i], h);
    }
    const Vectors4 t = Transpose(d[0], d[1], d[2], d[3]);
    const Vec4 length_sq = (t.x * t.x + t.y * t.y) + t.z * t.z;
    const Mask4 is_taut = length_sq > group.length * group.length;
    if (!IsAnyLaneSet(is_taut)) continue;
    const Vec4 length = Sqrt(length_sq);
    const Vec4 speed = TetherSpeed(length, group.length, context.substep.inverse_interval);
    if (context.controls.has_start_directions()) {
      PullAlongStarts<kAsks>(context, g, Directions(t, length), is_taut ? speed : Vec4{});
      continue;
    }
    const Vec4 speed_per_length = is_taut ? speed / length : Vec4{};
#pragma GCC unroll 4
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      if constexpr (kAsks) {
        PullBothEnds(context, g, k, speed_per_length[k] * d[k]);
      } else if (MayPull(context, group.particle[k])) {
        u[group.particle[k]] -= speed_per_length[k] * d[k];
      }
    }
  }
}

}  // namespace

void Tether(const StepContext& context) {
  const FloatModel& model = context.model;
  if (!context.controls.Has(StepStage::kTether)) return;
  const std::vector<uint32_t>& offsets = model.tether_block_offsets;
  context.ForRanges(offsets.size() - 1, kBlockGrain, [&](size_t begin, size_t end) {
    if (context.impulses() != nullptr) {
      PullGroups<true>(context, offsets[begin], offsets[end]);
    } else {
      PullGroups<false>(context, offsets[begin], offsets[end]);
    }
  });
}

}  // namespace drape::cpu
