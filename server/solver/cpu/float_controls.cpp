#include "server/solver/cpu/float_controls.h"

#include <cmath>
#include <variant>

namespace drape::cpu {
namespace {

FloatCollider ToFloat(const Collider& collider, double thickness_m) {
  if (const auto* sphere = std::get_if<SphereCollider>(&collider)) {
    return {true, ToLanes(sphere->center_m), Lanes{},
            static_cast<float>(sphere->radius_m + thickness_m)};
  }
  const auto& plane = std::get<PlaneCollider>(collider);
  return {false, ToLanes(plane.point_m), ToLanes(plane.normal), static_cast<float>(thickness_m)};
}

}  // namespace

FloatControls::FloatControls(const FloatModel& model, const ClothParameters& parameters) {
  const StepSettings& settings = parameters.settings;
  const double substep_s = settings.substep_s();
  const double tolerance_met = SinglePrecisionTolerance(settings.tolerance, *model.source);
  substeps = settings.substeps;
  max_iterations = settings.max_iterations;
  h = static_cast<float>(substep_s);
  inverse_h = static_cast<float>(1 / substep_s);
  tolerance = static_cast<float>(tolerance_met);
  contact_tolerance = static_cast<float>(tolerance_met * model.source->length_scale_m());
  depenetration_distance = static_cast<float>(kMaxDepenetrationSpeed_m_per_s * substep_s);
  damping_factor = static_cast<float>(std::exp(-parameters.damping_per_s * substep_s));
  friction_static = static_cast<float>(parameters.friction_static);
  friction_dynamic = static_cast<float>(parameters.friction_dynamic);
  gravity = ToLanes(parameters.gravity_m_per_s2);
  for (const Collider& collider : parameters.colliders) {
    colliders.push_back(ToFloat(collider, parameters.thickness_m));
  }
  use_tethers = settings.use_tethers;
  const bool is_in_force = settings.spring_integration == SpringIntegration::kInForce;
  has_half_kicks = model.has_springs() && !is_in_force;
  has_spring_forces = model.has_springs() && is_in_force;
  warnings.tolerance_raised = tolerance_met > settings.tolerance;
  warnings.springs_beyond_limit = AreSpringsBeyondLimit(*model.source, substep_s);
}

}  // namespace drape::cpu
