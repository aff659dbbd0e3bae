#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

// No particle ends the substep farther from a pin than the cloth between them is long (an
// inequality in the sense of Bender et al. 2009, section 3.1); in the order of the pins.
void Tether(StepContext& context) {
  if (!context.plan.Has(StepStage::kTether)) return;
  const SceneModel& model = context.model;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (context.w[i] == 0) continue;
    const uint32_t end = model.tether_offsets()[i + 1];
    for (uint32_t t = model.tether_offsets()[i]; t < end; ++t) {
      const auto [pin, reach] = model.tethers()[t];
      const Vector3d d = context.PredictedDifference(pin, i);
      const double excess = d.norm() - reach;
      if (!(excess > 0)) continue;
      const auto [n, slope] =
          BlendDirections(context.base[i] - context.base[pin], d, context.plan.solver.end_share);
      context.u[i] -= n * (excess / context.h / slope);
      context.Pull(pin, model.masses_kg()[i] * n * (excess / context.h / slope));
    }
  }
}

}  // namespace drape::reference
