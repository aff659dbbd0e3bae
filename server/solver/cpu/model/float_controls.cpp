#include "server/solver/cpu/model/float_controls.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "server/solver/hinge_stages.h"

namespace drape::cpu {
namespace {

FloatCollider ToFloat(const Collider& collider, double thickness_m) {
  const ColliderNumbers numbers = NumbersOf(collider);
  const std::shared_ptr<const DistanceMap> map = MapOf(collider);
  const auto axis = [&](int k) { return ToVec4(numbers.axes.col(k)); };
  return {.kind = collider.kind(),
          .place = {ToVec4(numbers.point_m), ToVec4(numbers.vector), {axis(0), axis(1), axis(2)}},
          .offset = static_cast<float>(numbers.radius_m + thickness_m),
          .samples = map != nullptr ? DistanceSamples(map) : DistanceSamples(),
          .size = static_cast<float>(numbers.point_m.lpNorm<1>())};
}

}  // namespace

FloatControls::FloatControls(const FloatModel& model, const ClothParameters& parameters,
                             bool has_own_lengths)
    : plan(PlanStep(*model.source, parameters,
                    has_own_lengths ? LengthSource::kOwn : LengthSource::kModel,
                    ScalarType::kFloat32)),
      energy_limit(EnergyLimitOf(*model.source, parameters,
                                 has_own_lengths ? LengthSource::kOwn : LengthSource::kModel,
                                 plan)),
      refine_limits(std::max(plan.solver.refine_above_strain, plan.tolerance)) {
  const StepSettings& settings = parameters.settings;
  const double substep_s = settings.substep_s();
  damping_per_s = parameters.damping_per_s;
  span_give = static_cast<float>(plan.solver.span_give);
  end_share = static_cast<float>(plan.solver.end_share);
  thickness_m = parameters.thickness_m;
  time_step_s = settings.time_step_s;
  time_step = static_cast<float>(settings.time_step_s);
  h = static_cast<float>(substep_s);
  inverse_h = static_cast<float>(1 / substep_s);
  tolerance = static_cast<float>(plan.tolerance);
  contact_tolerance = static_cast<float>(plan.tolerance * model.source->length_scale_m());
  depenetration_distance = static_cast<float>(kMaxDepenetrationSpeed_m_per_s * substep_s);
  friction_static = static_cast<float>(parameters.friction_static);
  friction_dynamic = static_cast<float>(parameters.friction_dynamic);
  touches_itself = plan.Has(StepStage::kFindSelfContacts);
  contact = SelfContactOf(parameters);
  has_bodies = HasBodies(parameters.colliders);
  bodies = BodyNumbersOf(parameters);
  has_restitution = HasRestitution(parameters);
  restitution = static_cast<float>(parameters.restitution);
  slowest_rebound = static_cast<float>(SlowestRebound(parameters));
  slowest_landing = static_cast<float>(SlowestLanding(parameters));
  slowest_slip = static_cast<float>(SlowestSlip(parameters));
  gravity = ToVec4(parameters.gravity_m_per_s2);
  wind = ToVec4(parameters.wind_m_per_s);
  air_drag = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_drag / 4);
  air_lift = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_lift / 4);
  max_elastic_frequency_sq = static_cast<float>(plan.max_elastic_frequency_sq_per_s2);
  for (const auto& [momentum, gain] : HingeStages(plan.solver.hinge_stages)) {
    hinge_stages.push_back({static_cast<float>(momentum), static_cast<float>(gain)});
  }
  if (plan.solver.has_elastic_lines) {
    elastic_entries = model.elastic_entries.Get(model, plan.schedule.largest_force_interval_s2());
  }
  if (Has(StepStage::kApplyElastic) && !model.grid_elements.empty()) {
    grid_strengths = model.grid_strengths.Get(*model.source, model.grid_elements, h, inverse_h,
                                              max_elastic_frequency_sq);
  }
  for (const Collider& collider : parameters.colliders) {
    colliders.push_back(ToFloat(collider, parameters.thickness_m));
  }
}

}  // namespace drape::cpu
