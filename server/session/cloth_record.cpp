#include "server/session/cloth_record.h"

#include <cmath>
#include <utility>

#include "server/core/check.h"
#include "server/scene/ropes.h"
#include "server/solver/load.h"
#include "server/solver/surface_fields.h"

namespace drape {
namespace {

// The nearest number with the 24 significant bits of single precision. Computed by arithmetic,
// because GCC 12 vectorises double -> float -> double of neighbouring values into nothing.
double RoundToSinglePrecision(double value) {
  constexpr int kSignificantBits = 24;
  int exponent = 0;
  std::frexp(value, &exponent);
  const int shift = kSignificantBits - exponent;
  return std::ldexp(std::nearbyint(std::ldexp(value, shift)), -shift);
}

}  // namespace

ClothRecord::ClothRecord(Placement its_placement, RigidTransform its_transform,
                         std::shared_ptr<const ClothDescription> description,
                         std::shared_ptr<const ClearStart> start, ClothCharges charges)
    : placement(std::move(its_placement)),
      transform(std::move(its_transform)),
      start_(std::move(start)),
      description_(std::move(description)),
      charges_(std::move(charges)) {}

std::shared_ptr<const ClothDescription> ClothRecord::description() const {
  const std::lock_guard lock(mutex_);
  return description_;
}

ClothCharges ClothRecord::charges() const {
  const std::lock_guard lock(mutex_);
  return charges_;
}

void ClothRecord::ReplaceDescription(std::shared_ptr<const ClothDescription> description,
                                     ClothCharges charges) {
  const std::lock_guard lock(mutex_);
  description_.swap(description);  // the old ones are freed without the lock
  std::swap(charges_, charges);
}

void ClothRecord::DropCharges() {
  ClothCharges dropped;  // freed without the lock
  held_lengths.Drop();
  held_colliders.Drop();
  const std::lock_guard lock(mutex_);
  std::swap(charges_, dropped);
}

ParticleState ClothRecord::InitialState() const {
  return PlaceAtStart(*description()->model, transform, placement, start().get());
}

ParticleState ClothRecord::StateAt(const RigidTransform& other_transform) const {
  return PlaceAtStart(*description()->model, other_transform, placement);
}

std::shared_ptr<const ClearStart> ClothRecord::start() const {
  if (start_ == nullptr || start_->clearance != StartClearance::kCleared) return start_;
  const auto model = description()->model;
  const LengthErrors errors = FindLengthErrors(model->length_demands(), start_->positions_m);
  return NeedsRestoring(errors) ? nullptr : start_;
}

Eigen::Vector3d OriginInEnvironment(const SceneModel& model, const RigidTransform& transform) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : model.rest_positions_m()) sum += p;
  const Eigen::Vector3d centroid = transform * (sum / model.particle_count());
  return {RoundToSinglePrecision(centroid.x()), RoundToSinglePrecision(centroid.y()),
          RoundToSinglePrecision(centroid.z())};
}

ParticleState PlaceAtStart(const SceneModel& model, const RigidTransform& transform,
                           const Placement& placement, const ClearStart* start) {
  ParticleState state;
  state.velocities_m_per_s.assign(model.particle_count(), Eigen::Vector3d::Zero());
  if (start != nullptr && start->clearance == StartClearance::kCleared) {
    state.positions_m = start->positions_m;
    return state;
  }
  state.positions_m.reserve(model.particle_count());
  for (const Eigen::Vector3d& p : model.start_positions_m()) {
    state.positions_m.push_back(placement.ClothFromEnvironment(transform * p));
  }
  return state;
}

ClothParameters OnDevice(const SceneModel& model, const ClothParameters& parameters,
                         const Placement& placement) {
  return RaiseSubsteps(model, InClothFrame(parameters, placement));
}

ClothParameters InClothFrame(const ClothParameters& parameters, const Placement& placement) {
  ClothParameters shifted = parameters;
  for (Collider& collider : shifted.colliders) {
    collider.pose.position_m = placement.ClothFromEnvironment(collider.pose.position_m);
    for (BodyJoint& joint : collider.joints) {
      joint.point_m = placement.ClothFromEnvironment(joint.point_m);
      joint.other_point_m = placement.ClothFromEnvironment(joint.other_point_m);
      for (Eigen::Vector3d& pulley_m : joint.pulleys_m) {
        pulley_m = placement.ClothFromEnvironment(pulley_m);
      }
    }
  }
  for (RigidMotion& motion : shifted.collider_motions) {
    motion.pivot_m = placement.ClothFromEnvironment(motion.pivot_m);
    motion.position_m = placement.ClothFromEnvironment(motion.position_m);
  }
  return shifted;
}

void StartColliders(const ClothParameters& in_cloth_frame, ClothRuntime& runtime) {
  std::vector<Eigen::Vector3d> pivots_m;
  for (const Collider& collider : in_cloth_frame.colliders) pivots_m.push_back(CentreOf(collider));
  runtime.controls().StartColliders(in_cloth_frame.collider_motions, std::move(pivots_m),
                                    runtime.now().time_s);
}

std::vector<RigidMotion> ColliderMotionsNow(const ClothRecord& cloth) {
  std::vector<RigidMotion> motions = cloth.runtime->collider_motions();
  for (RigidMotion& motion : motions) {
    motion.pivot_m = cloth.placement.EnvironmentFromCloth(motion.pivot_m);
    motion.position_m = cloth.placement.EnvironmentFromCloth(motion.position_m);
  }
  return motions;
}

std::vector<Collider> DrawnColliders(const ClothRecord& cloth) {
  const std::vector<RigidMotion> motions = ColliderMotionsNow(cloth);
  std::vector<Collider> colliders = cloth.description()->parameters.colliders;
  // The colliders are being replaced: as described.
  if (motions.size() != colliders.size()) return colliders;
  const std::vector<Collider> ropes = RopesOf(colliders, motions);
  for (size_t k = 0; k < colliders.size(); ++k) colliders[k] = Moved(colliders[k], motions[k]);
  colliders.insert(colliders.end(), ropes.begin(), ropes.end());
  return colliders;
}

ReportShift ShiftOf(const SceneModel& model, const ClothParameters& parameters,
                    const Placement& placement) {
  double mass_kg = 0;
  for (const double m : model.masses_kg()) mass_kg += m;
  ReportShift shift;
  shift.lowest_m = placement.WorldFromCloth(Eigen::Vector3d::Zero()).y();
  // -sum m g.(p + origin) = -sum m g.p - M g.origin
  shift.potential_energy_j =
      -mass_kg * parameters.gravity_m_per_s2.dot(placement.origin_in_environment_m);
  return shift;
}

std::vector<Eigen::Vector3d> PinTargets(const std::vector<Pin>& pins, const Placement& placement,
                                        const std::vector<Eigen::Vector3d>& starts_m) {
  DRAPE_CHECK(pins.size() == starts_m.size(), "one start per pin");
  std::vector<Eigen::Vector3d> targets_m = starts_m;
  for (size_t k = 0; k < pins.size(); ++k) {
    if (pins[k].target_m.has_value()) {
      targets_m[k] = placement.ClothFromEnvironment(*pins[k].target_m);
    }
  }
  return targets_m;
}

namespace {

// `path`: of the message with the numbers that changed.
Status CheckFriction(const ClothParameters& changed, const NumberChanges<ClothParameters>& numbers,
                     const std::string& path) {
  if (changed.friction_dynamic <= changed.friction_static) return Status::Ok();
  return Status::InvalidField(
      path + (numbers.IsSet(&ClothParameters::friction_dynamic) ? ".friction_dynamic"
                                                                : ".friction_static"),
      "friction_dynamic would be " + std::to_string(changed.friction_dynamic) +
          ", above friction_static " + std::to_string(changed.friction_static));
}

// With friction of the cloth on itself as it would be then.
Result<ClothParameters> WithCheckedSelfFriction(ClothParameters changed) {
  const std::vector<FieldViolation> violations = CheckSelfFriction(changed);
  if (violations.empty()) return changed;
  return Status::InvalidField("spec." + violations[0].field, violations[0].description);
}

}  // namespace

Result<ClothParameters> ApplyChange(const ClothParameters& current, const ClothChange& change) {
  ClothParameters changed = current;
  changed.gravity_m_per_s2 = change.gravity_m_per_s2.value_or(current.gravity_m_per_s2);
  changed.wind_m_per_s = change.wind_m_per_s.value_or(current.wind_m_per_s);
  change.numbers.ApplyTo(changed);
  if (change.colliders.has_value()) {
    changed.colliders = *change.colliders;
    changed.collider_motions = change.collider_motions;
  }
  changed.settings = change.settings.value_or(current.settings);
  if (change.self_collision.has_value()) changed.self_collision = *change.self_collision;
  DRAPE_RETURN_IF_ERROR(CheckFriction(changed, change.numbers, "spec.material"));
  return WithCheckedSelfFriction(std::move(changed));
}

Result<ClothParameters> ApplyChange(const ClothParameters& current, const ClothChange& change,
                                    size_t index) {
  DRAPE_ASSIGN_OR_RETURN(ClothParameters changed, ApplyChange(current, change));
  if (change.overrides.empty()) return changed;
  const ParameterOverride& own = change.overrides[index];
  changed.gravity_m_per_s2 = own.gravity_m_per_s2.value_or(changed.gravity_m_per_s2);
  changed.wind_m_per_s = own.wind_m_per_s.value_or(changed.wind_m_per_s);
  own.numbers.ApplyTo(changed);
  DRAPE_RETURN_IF_ERROR(
      CheckFriction(changed, own.numbers, "overrides[" + std::to_string(index) + "]"));
  return WithCheckedSelfFriction(std::move(changed));
}

}  // namespace drape
