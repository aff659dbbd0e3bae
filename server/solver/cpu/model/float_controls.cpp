#include "server/solver/cpu/model/float_controls.h"

#include <algorithm>
#include <cmath>
#include <variant>

namespace drape::cpu {
namespace {

using Kind = FloatCollider::Kind;

FloatCollider ToFloat(const SphereCollider& sphere, double thickness_m) {
  return {Kind::kSphere, ToVec4(sphere.center_m), Vec4{},
          static_cast<float>(sphere.radius_m + thickness_m)};
}

FloatCollider ToFloat(const PlaneCollider& plane, double thickness_m) {
  return {Kind::kPlane, ToVec4(plane.point_m), ToVec4(plane.normal),
          static_cast<float>(thickness_m)};
}

FloatCollider ToFloat(const CapsuleCollider& capsule, double thickness_m) {
  return {Kind::kCapsule,
          ToVec4(capsule.a_m),
          ToVec4(capsule.b_m - capsule.a_m),
          static_cast<float>(capsule.radius_m + thickness_m),
          {ToVec4(NormalOnSegment(capsule))}};
}

FloatCollider ToFloat(const BoxCollider& box, double thickness_m) {
  const Eigen::Matrix3d axes = box.rotation.toRotationMatrix();
  return {Kind::kBox,
          ToVec4(box.center_m),
          ToVec4(box.half_extents_m),
          static_cast<float>(thickness_m),
          {ToVec4(axes.col(0)), ToVec4(axes.col(1)), ToVec4(axes.col(2))}};
}

FloatCollider ToFloat(const DistanceMapCollider& solid, double thickness_m) {
  const Eigen::Matrix3d axes = solid.transform.rotation.toRotationMatrix();
  return {Kind::kDistanceMap,
          ToVec4(solid.transform * solid.map->low_m()),
          Vec4{},
          static_cast<float>(thickness_m),
          {ToVec4(axes.col(0)), ToVec4(axes.col(1)), ToVec4(axes.col(2))},
          DistanceSamples(solid.map)};
}

}  // namespace

FloatControls::FloatControls(const FloatModel& model, const ClothParameters& parameters,
                             bool has_own_lengths)
    : plan(PlanStep(*model.source, parameters,
                    has_own_lengths ? LengthSource::kOwn : LengthSource::kModel,
                    ScalarType::kFloat32)),
      refine_limits(std::max(plan.solver.refine_above_strain, plan.tolerance)) {
  const StepSettings& settings = parameters.settings;
  const double substep_s = settings.substep_s();
  damping_per_s = parameters.damping_per_s;
  end_share = static_cast<float>(plan.solver.end_share);
  time_step = static_cast<float>(settings.time_step_s);
  h = static_cast<float>(substep_s);
  inverse_h = static_cast<float>(1 / substep_s);
  tolerance = static_cast<float>(plan.tolerance);
  contact_tolerance = static_cast<float>(plan.tolerance * model.source->length_scale_m());
  depenetration_distance = static_cast<float>(kMaxDepenetrationSpeed_m_per_s * substep_s);
  friction_static = static_cast<float>(parameters.friction_static);
  friction_dynamic = static_cast<float>(parameters.friction_dynamic);
  has_restitution = HasRestitution(parameters);
  restitution = static_cast<float>(parameters.restitution);
  slowest_rebound = static_cast<float>(SlowestRebound(parameters));
  gravity = ToVec4(parameters.gravity_m_per_s2);
  wind = ToVec4(parameters.wind_m_per_s);
  air_drag = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_drag / 4);
  air_lift = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_lift / 4);
  for (const Collider& collider : parameters.colliders) {
    colliders.push_back(std::visit(
        [&](const auto& shape) { return ToFloat(shape, parameters.thickness_m); }, collider));
  }
}

}  // namespace drape::cpu
