#include "server/solver/cpu_reference/reference_context.h"

namespace drape::reference {
namespace {

std::vector<Grip> HeldBy(const ReferenceCloth& cloth) {
  std::vector<Grip> held;
  for (uint32_t k = 0; k < cloth.model->pin_count(); ++k) {
    held.push_back({cloth.model->pins()[k], cloth.pin_targets_m[k]});
  }
  held.insert(held.end(), cloth.grips.begin(), cloth.grips.end());
  return held;
}

std::vector<double> InverseMasses(const SceneModel& model, const std::vector<Grip>& held) {
  const std::span<const double> of_model = model.inverse_masses_per_kg();
  std::vector<double> w(of_model.begin(), of_model.end());
  for (const Grip& grip : held) w[grip.particle] = 0;
  return w;
}

}  // namespace

StepContext::StepContext(const SteppedReference& stepped, const ClothParameters& its_parameters,
                         const StepPlan& step_plan, uint32_t most_iterations,
                         Interruption* its_interruption)
    : model(*stepped.cloth->model),
      parameters(its_parameters),
      plan(step_plan),
      max_iterations(most_iterations),
      interruption(its_interruption),
      origin_m(stepped.origin_m),
      held(HeldBy(*stepped.cloth)),
      w(InverseMasses(model, held)),
      bodies(parameters.colliders, parameters.collider_motions, BodyNumbersOf(parameters),
             model.particle_count(), 0),
      colliders(parameters, bodies),
      rest_lengths(model, stepped.cloth->rest_lengths_m, stepped.cloth->rest_length_targets_m),
      state(stepped.cloth->state),
      previous(stepped.cloth->state),
      base(model.particle_count()),
      u(model.particle_count()),
      a(model.particle_count()),
      impulses(stepped.asked.impulses
                   ? std::make_unique<ImpulseSums>(model, held, colliders.size(),
                                                   stepped.asked.contact_impulses)
                   : nullptr) {
  if (stepped.asked.contact_impulses) bodies.KeepContacts();
  surface_contacts.Begin(*this, stepped.cloth->surface_parts.get());
}

}  // namespace drape::reference
