#include "server/solver/cpu/alone/wind.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// First phase: the impulses of the triangles, all from the same velocities. Groups [begin, end).
void StoreAirImpulses(const StepContext& context, const Vec4* p, float duration, size_t begin,
                      size_t end) {
  const FloatControls& controls = context.controls;
  const Vec4* const v = context.scratch.state.velocities.data();
  Vec4* impulses = context.scratch.air_impulses.data() + begin * kVec4Size;
  for (size_t g = begin; g < end; ++g) {
    const TriangleGroup& group = context.model.triangles[g];
    const auto& [i, j, k] = group.corners;
    const Vectors4 mean = group.weights[0] * Gather(v, i) + group.weights[1] * Gather(v, j) +
                          group.weights[2] * Gather(v, k);
    const Vectors4 relative{controls.wind[0] - mean.x, controls.wind[1] - mean.y,
                            controls.wind[2] - mean.z};
    const Vectors4 p_i = Gather(p, i);
    const Vectors4 normal = Cross(Gather(p, j) - p_i, Gather(p, k) - p_i);
    const Vectors4 change =
        AirVelocityChange(relative, normal, duration * controls.air_drag / group.mass,
                          duration * controls.air_lift / group.mass);
    for (uint32_t lane = 0; lane < kVec4Size; ++lane) {
      *impulses++ = group.mass[lane] * Vec4{change.x[lane], change.y[lane], change.z[lane], 0};
    }
  }
}

}  // namespace

void ApplyWind(const StepContext& context, const Vec4* positions, float duration) {
  if (!context.controls.Has(StepStage::kApplyWind)) return;
  const FloatModel& model = context.model;
  context.ForRanges(model.triangles.size(), kGroupGrain, [&](size_t begin, size_t end) {
    StoreAirImpulses(context, positions, duration, begin, end);
  });
  const auto offsets = model.source->triangle_offsets();
  const auto triangles = model.source->particle_triangles();
  StepScratch& scratch = context.scratch;
  const auto impulse_on = [&](uint32_t i) {
    Vec4 impulse{};
    for (uint32_t e = offsets[i]; e < offsets[i + 1]; ++e) {
      impulse += scratch.air_impulses[triangles[e]];
    }
    return impulse;
  };
  context.ForHeldAsked(
      [&](uint32_t i, ImpulseSums& sums) { sums.Pull(i, model.corner_shares[i] * impulse_on(i)); });
  context.ForFreeParticles([&](uint32_t i) {
    scratch.state.velocities[i] +=
        model.corner_shares[i] * (context.held.inverse_masses[i] * impulse_on(i));
  });
}

}  // namespace drape::cpu
