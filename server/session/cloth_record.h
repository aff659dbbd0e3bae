// Everything the server knows about a cloth except its state on the device.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/core/ids.h"
#include "server/scene/description.h"
#include "server/scene/particle_state.h"
#include "server/scene/placement.h"
#include "server/scene/scene_model.h"
#include "server/scene/start_clearance.h"
#include "server/scheduler/cloth_runtime.h"
#include "server/session/held_charge.h"
#include "server/session/map_quota.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// One copy of a CreateCloths request.
struct ClothCopy {
  RigidTransform transform;  // places the rest shape in the cloth's environment
  Eigen::Vector3d environment_origin_m = Eigen::Vector3d::Zero();  // in the world
  // Checked by the caller. Colliders in the ENVIRONMENT frame (not, as solvers want them, in the
  // cloth's own).
  ClothParameters parameters;
  // Start positions (cloth frame) that replace the model's, or a note that the cloth is caught in a
  // collider (FindClearStarts); null: use the model's.
  std::shared_ptr<const ClearStart> start{};
  // With the lengths that the start lets out; null: those of the creation.
  std::shared_ptr<const ModelDescription> description{};
  std::shared_ptr<const SceneModel> model{};
  // Filled in by Session::CreateCloths.
  std::shared_ptr<const void> model_charge{};
  std::shared_ptr<const void> collider_charge{};
};

// What BackendDescription::make_shared_parts has made, held until the cloths are there.
using SharedParts = std::vector<std::shared_ptr<const void>>;

// The input of Session::CreateCloths, in the frames that clients see.
struct ClothCreation {
  // `model` was built from `description`, which is kept to build it again with other pins.
  std::shared_ptr<const ModelDescription> description;
  std::shared_ptr<const SceneModel> model;
  // Exactly the model's pins, any order; targets in the environment frame, the same for every copy.
  std::vector<Pin> pins;
  std::vector<ClothCopy> copies;  // at least one
  std::string world{};            // cloths of the same name touch each other; empty: none
  // Filled in by Session::CreateCloths: for the copies' colliders, for the model (SharedModel).
  MapCharges map_charges{};
  std::shared_ptr<const void> model_charge{};
  SharedParts shared_parts{};  // of PrepareCloths
};

// New values of some of the numbers of an Owner; the others stay.
template <class Owner>
class NumberChanges {
 public:
  void Set(double Owner::*member, double value) { values_.emplace_back(member, value); }
  bool IsSet(double Owner::*member) const {
    return std::ranges::any_of(values_, [&](const auto& entry) { return entry.first == member; });
  }
  bool is_any_set() const { return !values_.empty(); }
  void ApplyTo(Owner& owner) const {
    for (const auto& [member, value] : values_) owner.*member = value;
  }

 private:
  std::vector<std::pair<double Owner::*, double>> values_;
};

// In a ModelChange: a rest length equal to the distance in the rest shape.
inline constexpr double kRestShapeLength = -1;

// Changes that need another model. Unset = unchanged; the particles stay.
struct ModelChange {
  NumberChanges<StructuralMaterial> material;
  // For cloths made of particles; each replaces the whole list.
  std::optional<std::vector<DistanceConstraint>> distance_constraints;
  std::optional<std::vector<Spring>> springs;
  std::optional<std::vector<PointJoint>> point_joints;

  bool is_any_set() const {
    return material.is_any_set() || distance_constraints || springs || point_joints;
  }
};

// A change of the parameters of one cloth. Unset = unchanged.
struct ParameterOverride {
  std::optional<Eigen::Vector3d> gravity_m_per_s2;
  std::optional<Eigen::Vector3d> wind_m_per_s;
  NumberChanges<ClothParameters> numbers;  // of kSurfaceFields
};

// Unset = unchanged. Applied to several cloths, to all or none.
struct ClothChange {
  std::optional<Eigen::Vector3d> gravity_m_per_s2;
  std::optional<Eigen::Vector3d> wind_m_per_s;
  NumberChanges<ClothParameters> numbers;          // of kSurfaceFields
  std::optional<std::vector<Collider>> colliders;  // environment frame
  MapCharges map_charges{};                        // for them; filled in by Session::UpdateCloths
  std::vector<RigidMotion> collider_motions;       // of `colliders`, or empty: they rest
  std::optional<StepSettings> settings;            // fully resolved
  // Set: it replaces the cloth's, be it by none.
  std::optional<std::optional<SelfCollision>> self_collision;
  // Replaces all pins. A remaining pin keeps its motion unless it has a target here; a new pin
  // starts at its particle. A pin with a target moves there within one step. The state is kept.
  std::optional<std::vector<Pin>> pins;
  ModelChange model;
  // Of each cloth its own, [cloth_count] or empty; after everything else.
  std::vector<ParameterOverride> overrides{};

  bool needs_model() const { return pins.has_value() || model.is_any_set(); }
  // Whether the device may need other programs for the cloths than before.
  bool may_need_programs() const {
    return needs_model() || colliders || settings || self_collision || wind_m_per_s ||
           numbers.is_any_set() || !overrides.empty();
  }
};

// The part of a cloth that can change during its life. Immutable; replaced as a whole.
struct ClothDescription {
  std::shared_ptr<const ModelDescription> model_description;
  std::shared_ptr<const SceneModel> model;
  ClothParameters parameters;  // colliders in the environment frame
  std::vector<Pin> pins;       // sorted by particle, like model->pins()
  std::string plan;            // BackendDescription::plan_of
};

inline uint32_t ColliderCountOf(const ClothDescription& description) {
  return static_cast<uint32_t>(description.parameters.colliders.size());
}

// What a description counts for while somebody has it. Apart from it, so that a cloth can end
// without a copy of all its pins and colliders.
struct ClothCharges {
  MapCharges maps{};                    // for its colliders
  std::shared_ptr<const void> model{};  // SharedModel
};

// A cloth of a session. Thread-safe.
class ClothRecord {
 public:
  // `start` as in ClothCopy.
  ClothRecord(Placement placement, RigidTransform transform,
              std::shared_ptr<const ClothDescription> description,
              std::shared_ptr<const ClearStart> start = nullptr, ClothCharges charges = {});

  // Set once, before other threads see the record.
  ClothId id;
  std::string session_name;
  uint64_t creation_number = 0;  // ascending in order of creation, per server
  std::string world;             // ClothCreation::world

  // Constant.
  const Placement placement;
  const RigidTransform transform;
  const std::shared_ptr<ClothRuntime> runtime = std::make_shared<ClothRuntime>();

  HeldCharge held_lengths;  // rest lengths of its own, which it has once any has been driven
  HeldCharge held_colliders;

  std::shared_ptr<const ClothDescription> description() const;
  // Of the description.
  ClothCharges charges() const;
  // Device thread: no two changes at once.
  void ReplaceDescription(std::shared_ptr<const ClothDescription> description,
                          ClothCharges charges);
  // The cloth has ended: it counts no longer, though the record may still be held. Device thread.
  void DropCharges();

  // The state of creation, computed again from the model: the same bits each time.
  ParticleState InitialState() const;
  // At rest where another transform places the rest shape; in the same cloth frame.
  ParticleState StateAt(const RigidTransform& other_transform) const;
  // The start of creation while it fits the lengths of the model; otherwise null.
  std::shared_ptr<const ClearStart> start() const;
  // As of the creation.
  const std::shared_ptr<const ClearStart>& described_start() const { return start_; }

 private:
  const std::shared_ptr<const ClearStart> start_;
  mutable std::mutex mutex_;
  std::shared_ptr<const ClothDescription> description_;
  ClothCharges charges_;
};

// The origin of the cloth frame: the centroid of the rest positions, rounded to single precision so
// that float and double backends see the same frame. [m], environment frame.
Eigen::Vector3d OriginInEnvironment(const SceneModel& model, const RigidTransform& transform);

// The model's start positions, or those of `start` if it has some, in the cloth frame; at rest.
ParticleState PlaceAtStart(const SceneModel& model, const RigidTransform& transform,
                           const Placement& placement, const ClearStart* start = nullptr);

// From the environment frame to the cloth frame: only the colliders change.
ClothParameters InClothFrame(const ClothParameters& parameters, const Placement& placement);

// The parameters for the backend: in the cloth frame, with the substeps that the load needs.
ClothParameters OnDevice(const SceneModel& model, const ClothParameters& parameters,
                         const Placement& placement);

// Replaces the runtime's colliders by those of `in_cloth_frame`. Device thread.
void StartColliders(const ClothParameters& in_cloth_frame, ClothRuntime& runtime);

// The present poses and velocities of the colliders, in the environment frame; empty: they rest as
// described. Any thread.
std::vector<RigidMotion> ColliderMotionsNow(const ClothRecord& cloth);
// The collider shapes at their present positions, and the ropes of bodies, in the environment
// frame. Any thread.
std::vector<Collider> DrawnColliders(const ClothRecord& cloth);

// Brings a report of the cloth to the frames that clients see.
ReportShift ShiftOf(const SceneModel& model, const ClothParameters& parameters,
                    const Placement& placement);

// [pin_count] in the cloth frame, in the order of model.pins(): the target of each pin, or its
// start if it has none. `pins` sorted by particle.
std::vector<Eigen::Vector3d> PinTargets(const std::vector<Pin>& pins, const Placement& placement,
                                        const std::vector<Eigen::Vector3d>& starts_m);

// `current` with `change` applied. INVALID_ARGUMENT if legal values are illegal together:
// friction_dynamic > friction_static.
Result<ClothParameters> ApplyChange(const ClothParameters& current, const ClothChange& change);
// The same with override `index` of the change, if it has some ("overrides[3].friction_static").
Result<ClothParameters> ApplyChange(const ClothParameters& current, const ClothChange& change,
                                    size_t index);

}  // namespace drape
