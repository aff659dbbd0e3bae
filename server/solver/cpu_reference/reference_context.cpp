#include "server/solver/cpu_reference/reference_context.h"

namespace drape::reference {

StepContext::StepContext(const ReferenceCloth& cloth, const StepPlan& step_plan,
                         uint32_t most_iterations)
    : model(*cloth.model),
      parameters(cloth.parameters),
      pin_targets(cloth.pin_targets_m),
      plan(step_plan),
      max_iterations(most_iterations),
      w(model.inverse_masses_per_kg()),
      colliders(parameters),
      rest_lengths(model, cloth.rest_lengths_m, cloth.rest_length_targets_m),
      state(cloth.state),
      previous(cloth.state),
      base(model.particle_count()),
      u(model.particle_count()),
      a(model.particle_count()) {}

}  // namespace drape::reference
