#include "server/api/spec_validation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/api/collider_control_validation.h"
#include "server/api/topology_validation.h"
#include "server/scene/description_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

// A sphere, capsule or box smaller than this is one that single precision cannot tell from its
// surface.
constexpr double kMinRadius_m = 1e-9;
// Far above any gravity; a step of 10 s still gives a finite velocity in single precision.
constexpr double kMaxAcceleration_m_per_s2 = 1e12;

// Unit vector along `v`, without overflow or underflow. `v` must not be zero. A unit vector stays
// as it is, so that what a client reads back and sends again keeps its bits.
Eigen::VectorXd UnitVector(const Eigen::VectorXd& v) {
  constexpr double kFewRoundings = 16 * std::numeric_limits<double>::epsilon();
  if (std::abs(v.squaredNorm() - 1) <= kFewRoundings) return v;
  const Eigen::VectorXd scaled = v / v.cwiseAbs().maxCoeff();
  return scaled / scaled.norm();
}

SphereCollider CheckSphere(const FieldPath& path, const v1::Sphere& sphere, FieldChecks& checks) {
  SphereCollider result;
  const auto center_m =
      checks.Vector3(path.Child("center_m"), sphere.center_m(), kMaxExtent_m, "m");
  checks.InRange(path.Child("radius_m"), sphere.radius_m(), kMinRadius_m, kMaxExtent_m, "m");
  if (center_m) result.center_m = *center_m;
  result.radius_m = sphere.radius_m();
  return result;
}

PlaneCollider CheckPlane(const FieldPath& path, const v1::Plane& plane, FieldChecks& checks) {
  PlaneCollider result;
  const auto point_m = checks.Vector3(path.Child("point_m"), plane.point_m(), kMaxExtent_m, "m");
  const auto normal = checks.Vector3(path.Child("normal"), plane.normal(), kMaxCoefficient, "");
  if (point_m) result.point_m = *point_m;
  if (normal && checks.Require(!normal->isZero(0), path.Child("normal"), [] {
        return "(0, 0, 0) has no direction: a length > 0 is needed";
      })) {
    result.normal = UnitVector(*normal);
  }
  return result;
}

CapsuleCollider CheckCapsule(const FieldPath& path, const v1::Capsule& capsule,
                             FieldChecks& checks) {
  CapsuleCollider result;
  const auto a_m = checks.Vector3(path.Child("a_m"), capsule.a_m(), kMaxExtent_m, "m");
  const auto b_m = checks.Vector3(path.Child("b_m"), capsule.b_m(), kMaxExtent_m, "m");
  checks.InRange(path.Child("radius_m"), capsule.radius_m(), kMinRadius_m, kMaxExtent_m, "m");
  if (a_m) result.a_m = *a_m;
  if (b_m) result.b_m = *b_m;
  result.radius_m = capsule.radius_m();
  return result;
}

// Empty: no rotation.
Eigen::Quaterniond CheckOptionalRotation(const FieldPath& path, const DoubleList& xyzw,
                                         FieldChecks& checks) {
  if (xyzw.empty() || !checks.Length(path, static_cast<size_t>(xyzw.size()), 4, "x, y, z, w") ||
      !checks.AllWithin(path, xyzw, kMaxCoefficient, "")) {
    return Eigen::Quaterniond::Identity();
  }
  return CheckRotation(path, {xyzw[0], xyzw[1], xyzw[2], xyzw[3]}, checks);
}

BoxCollider CheckBox(const FieldPath& path, const v1::Box& box, FieldChecks& checks) {
  BoxCollider result;
  const FieldPath extents_path = path.Child("half_extents_m");
  const DoubleList& half_extents_m = box.half_extents_m();
  const auto center_m = checks.Vector3(path.Child("center_m"), box.center_m(), kMaxExtent_m, "m");
  if (center_m) result.center_m = *center_m;
  if (checks.Length(extents_path, static_cast<size_t>(half_extents_m.size()), 3, "x, y, z")) {
    for (int axis = 0; axis < 3; ++axis) {
      checks.InRange(extents_path.At(static_cast<size_t>(axis)), half_extents_m[axis], kMinRadius_m,
                     kMaxExtent_m, "m");
      result.half_extents_m[axis] = half_extents_m[axis];
    }
  }
  result.rotation = CheckOptionalRotation(path.Child("rotation_xyzw"), box.rotation_xyzw(), checks);
  return result;
}

// The map comes later, from a builder thread (collider_maps.h).
DistanceMapCollider CheckMeshCollider(const FieldPath& path, const v1::Collider& collider,
                                      const ClosedMeshLimits& limits, FieldChecks& checks) {
  const FieldPath mesh_path = path.Child("mesh");
  if (CheckMeshArrays(mesh_path, collider.mesh(), checks)) {
    checks.CountInRange(mesh_path.Child("positions_m"), collider.mesh().positions_m().shape(0), 4,
                        limits.max_vertices);
    checks.CountInRange(mesh_path.Child("triangles"), collider.mesh().triangles().shape(0), 4,
                        limits.max_triangles);
  }
  return {.map = nullptr,
          .transform = CheckTransform(path.Child("transform"), collider.transform(), checks)};
}

// What only meshes have.
void CheckMeshFields(const FieldPath& path, const v1::Collider& collider, FieldChecks& checks) {
  if (collider.has_scale_m()) {
    checks.Add(path.Child("scale_m"), "belongs to mesh_file, which only scene files may have");
  }
  if (collider.has_transform() && !collider.has_mesh() && !collider.has_mesh_file()) {
    checks.Add(path.Child("transform"), "belongs to mesh: other shapes say where they are");
  }
}

}  // namespace

Eigen::Quaterniond CheckRotation(const FieldPath& path, const Eigen::Vector4d& values,
                                 FieldChecks& checks) {
  if (!checks.Require(!values.isZero(0), path,
                      [] { return "(0, 0, 0, 0) is not a rotation: a length > 0 is needed"; })) {
    return Eigen::Quaterniond::Identity();
  }
  const Eigen::Vector4d unit = UnitVector(values);
  return {unit[3], unit[0], unit[1], unit[2]};
}

RigidTransform CheckTransform(const FieldPath& path, const v1::Transform& transform,
                              FieldChecks& checks) {
  RigidTransform result;
  result.position_m = checks.Vector3Or(result.position_m, path.Child("position_m"),
                                       transform.position_m(), kMaxExtent_m, "m");
  result.rotation =
      CheckOptionalRotation(path.Child("rotation_xyzw"), transform.rotation_xyzw(), checks);
  return result;
}

std::vector<Collider> CheckColliders(
    const FieldPath& path, const google::protobuf::RepeatedPtrField<v1::Collider>& colliders,
    const RequestLimits& limits, FieldChecks& checks) {
  std::vector<Collider> result;
  if (!checks.Require(static_cast<uint32_t>(colliders.size()) <= limits.max_colliders_per_cloth,
                      path, [&] {
                        return "has " + std::to_string(colliders.size()) + " elements, at most " +
                               std::to_string(limits.max_colliders_per_cloth) + " are allowed";
                      })) {
    return result;
  }
  const auto mesh_count =
      std::count_if(colliders.begin(), colliders.end(), [](const auto& c) { return c.has_mesh(); });
  checks.Require(static_cast<uint64_t>(mesh_count) <= limits.max_mesh_colliders_per_cloth, path,
                 [&] {
                   return "has " + std::to_string(mesh_count) + " meshes, at most " +
                          std::to_string(limits.max_mesh_colliders_per_cloth) + " are allowed";
                 });
  for (int k = 0; k < colliders.size(); ++k) {
    const FieldPath here = path.At(k);
    CheckMeshFields(here, colliders[k], checks);
    switch (colliders[k].shape_case()) {
      case v1::Collider::kSphere:
        result.emplace_back(CheckSphere(here.Child("sphere"), colliders[k].sphere(), checks));
        break;
      case v1::Collider::kPlane:
        result.emplace_back(CheckPlane(here.Child("plane"), colliders[k].plane(), checks));
        break;
      case v1::Collider::kCapsule:
        result.emplace_back(CheckCapsule(here.Child("capsule"), colliders[k].capsule(), checks));
        break;
      case v1::Collider::kBox:
        result.emplace_back(CheckBox(here.Child("box"), colliders[k].box(), checks));
        break;
      case v1::Collider::kMesh:
        result.emplace_back(CheckMeshCollider(here, colliders[k], limits.collider_mesh, checks));
        break;
      case v1::Collider::kMeshFile:
        checks.Add(here.Child("mesh_file"),
                   "a server reads no files: the client reads the file and sends `mesh`");
        break;
      case v1::Collider::SHAPE_NOT_SET:
        checks.Add(here, "no shape is set: one of sphere, plane, capsule, box, mesh is needed");
        break;
    }
  }
  return result;
}

std::vector<Pin> CheckPinTargets(const FieldPath& path,
                                 const google::protobuf::RepeatedPtrField<v1::Pin>& pins,
                                 FieldChecks& checks) {
  std::vector<Pin> result;
  for (int k = 0; k < pins.size() && !checks.is_full(); ++k) {
    Pin pin{.particle = pins[k].particle(), .target_m = {}};
    if (!pins[k].target_m().empty()) {
      pin.target_m =
          checks.Vector3(path.At(k).Child("target_m"), pins[k].target_m(), kMaxExtent_m, "m");
    }
    result.push_back(pin);
  }
  return result;
}

Eigen::Vector3d CheckGravity(const FieldPath& path, const DoubleList& gravity_m_per_s2,
                             const Eigen::Vector3d& fallback, FieldChecks& checks) {
  return checks.Vector3Or(fallback, path, gravity_m_per_s2, kMaxAcceleration_m_per_s2, "m/s^2");
}

Eigen::Vector3d CheckWind(const FieldPath& path, const DoubleList& wind_m_per_s,
                          const Eigen::Vector3d& fallback, FieldChecks& checks) {
  return checks.Vector3Or(fallback, path, wind_m_per_s, kMaxWind_m_per_s, "m/s");
}

void CheckSolverChoices(const FieldPath& path, const v1::StepSettings& settings,
                        StepSettingsOverrides& overrides, FieldChecks& checks) {
  if (checks.KnownEnum(path.Child("sweep"), settings.sweep(),
                       v1::StepSettings::Sweep_descriptor())) {
    if (settings.sweep() == v1::StepSettings::COLOURS) overrides.sweep = Sweep::kColours;
    if (settings.sweep() == v1::StepSettings::STRIPS) overrides.sweep = Sweep::kStrips;
    if (settings.sweep() == v1::StepSettings::STRIPS_THEN_COLOURS) {
      overrides.sweep = Sweep::kStripsThenColours;
    }
  }
  if (checks.KnownEnum(path.Child("direction"), settings.direction(),
                       v1::StepSettings::Direction_descriptor())) {
    if (settings.direction() == v1::StepSettings::AT_END) overrides.direction = Direction::kAtEnd;
    if (settings.direction() == v1::StepSettings::AT_START) {
      overrides.direction = Direction::kAtStart;
    }
    if (settings.direction() == v1::StepSettings::BLENDED) {
      overrides.direction = Direction::kBlended;
    }
  }
  if (checks.KnownEnum(path.Child("integration"), settings.integration(),
                       v1::StepSettings::Integration_descriptor())) {
    if (settings.integration() == v1::StepSettings::ONE_STEP) {
      overrides.integration = Integration::kOneStep;
    }
    if (settings.integration() == v1::StepSettings::TWO_STEP) {
      overrides.integration = Integration::kTwoStep;
    }
  }
}

StepSettings CheckSettings(const FieldPath& path, const v1::StepSettings& settings,
                           FieldChecks& checks) {
  StepSettingsOverrides overrides;
  if (checks.KnownEnum(path.Child("preset"), settings.preset(),
                       v1::StepSettings::Preset_descriptor())) {
    switch (settings.preset()) {
      case v1::StepSettings::PAPER:
        overrides.preset = Preset::kPaper;
        break;
      case v1::StepSettings::ACCURATE:
        overrides.preset = Preset::kAccurate;
        break;
      default:
        overrides.preset = Preset::kRealtime;
    }
  }
  if (checks.KnownEnum(path.Child("spring_integration"), settings.spring_integration(),
                       v1::StepSettings::SpringIntegration_descriptor()) &&
      settings.spring_integration() != v1::StepSettings::SPRING_INTEGRATION_UNSPECIFIED) {
    overrides.spring_integration = settings.spring_integration() == v1::StepSettings::IN_FORCE
                                       ? SpringIntegration::kInForce
                                       : SpringIntegration::kHalfKicks;
  }
  CheckSolverChoices(path, settings, overrides, checks);
  if (settings.has_twist_damping_per_s()) {
    overrides.twist_damping_per_s = settings.twist_damping_per_s();
  }
  if (settings.has_refine_above_strain()) {
    overrides.refine_above_strain = settings.refine_above_strain();
  }
  if (settings.has_time_step_s()) overrides.time_step_s = settings.time_step_s();
  if (settings.has_substeps()) overrides.substeps = settings.substeps();
  if (settings.has_max_iterations()) overrides.max_iterations = settings.max_iterations();
  if (settings.has_velocity_iterations()) {
    overrides.velocity_iterations = settings.velocity_iterations();
  }
  if (settings.has_use_tethers()) overrides.use_tethers = settings.use_tethers();
  if (settings.has_frame_budget_ms()) overrides.frame_budget_ms = settings.frame_budget_ms();
  if (settings.has_load_limit()) overrides.load_limit = settings.load_limit();
  if (settings.has_sleep_motion_m()) overrides.sleep_motion_m = settings.sleep_motion_m();
  if (settings.has_tolerance()) overrides.tolerance = settings.tolerance();
  const Result<StepSettings> resolved = ResolveSettings(overrides, path.ToString());
  if (resolved.ok()) return *resolved;
  checks.AddAll(resolved.status().violations());
  return {};
}

void CheckFriction(const FieldPath& static_path, const FieldPath& dynamic_path,
                   const ClothParameters& parameters, FieldChecks& checks) {
  const bool is_static_legal =
      checks.InRange(static_path, parameters.friction_static, 0, kMaxCoefficient, "");
  const bool is_dynamic_legal =
      checks.InRange(dynamic_path, parameters.friction_dynamic, 0, kMaxCoefficient, "");
  if (!is_static_legal || !is_dynamic_legal) return;
  checks.Require(parameters.friction_dynamic <= parameters.friction_static, dynamic_path, [&] {
    return NumberText(parameters.friction_dynamic) +
           " is not in [0, friction_static = " + NumberText(parameters.friction_static) + "]";
  });
}

void CheckSurfaceMaterial(const FieldPath& path, const v1::Material& material,
                          ClothParameters& parameters, FieldChecks& checks) {
  parameters.damping_per_s = material.damping_per_s();
  parameters.friction_static = material.friction_static();
  parameters.friction_dynamic = material.friction_dynamic();
  parameters.restitution = material.restitution();
  parameters.thickness_m = material.thickness_m();
  checks.InRange(path.Child("damping_per_s"), parameters.damping_per_s, 0, kMaxCoefficient, "1/s");
  checks.InRange(path.Child("restitution"), parameters.restitution, 0, 1, "");
  checks.InRange(path.Child("thickness_m"), parameters.thickness_m, 0, kMaxExtent_m, "m");
  parameters.air_drag = material.air_drag();
  parameters.air_lift = material.air_lift();
  checks.InRange(path.Child("air_drag"), parameters.air_drag, 0, kMaxAirCoefficient, "");
  checks.InRange(path.Child("air_lift"), parameters.air_lift, 0, kMaxAirCoefficient, "");
  CheckFriction(path.Child("friction_static"), path.Child("friction_dynamic"), parameters, checks);
}

StructuralMaterial ReadStructuralMaterial(const v1::Material& material) {
  StructuralMaterial result;
  if (material.has_areal_density_kg_per_m2()) {
    result.areal_density_kg_per_m2 = material.areal_density_kg_per_m2();
  }
  result.stretch_compliance_m_per_n = material.stretch_compliance_m_per_n();
  result.bending_stiffness_n_per_m = material.bending_stiffness_n_per_m();
  result.shear_stiffness_n_per_m = material.shear_stiffness_n_per_m();
  result.bending_rigidity_n_m = material.bending_rigidity_n_m();
  result.stretch_stiffness_n_per_m = material.stretch_stiffness_n_per_m();
  result.shear_modulus_n_per_m = material.shear_modulus_n_per_m();
  return result;
}

CheckedSpec CheckSpec(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                      FieldChecks& checks) {
  CheckedSpec result;
  result.description.material = ReadStructuralMaterial(spec.material());
  for (const v1::Pin& pin : spec.pins()) {
    result.description.pinned_particles.push_back(pin.particle());
  }
  if (std::optional<Topology> topology = ReadTopology(path, spec, checks)) {
    result.description.topology = std::move(*topology);
    checks.AddAll(CheckDescription(result.description, limits.model), path.ToString() + ".");
  }
  result.pins = CheckPinTargets(path.Child("pins"), spec.pins(), checks);
  result.transform = CheckTransform(path.Child("transform"), spec.transform(), checks);

  const FieldPath environment_path = path.Child("environment");
  const v1::Environment& environment = spec.environment();
  result.parameters.gravity_m_per_s2 =
      CheckGravity(environment_path.Child("gravity_m_per_s2"), environment.gravity_m_per_s2(),
                   result.parameters.gravity_m_per_s2, checks);
  result.parameters.wind_m_per_s =
      CheckWind(environment_path.Child("wind_m_per_s"), environment.wind_m_per_s(),
                result.parameters.wind_m_per_s, checks);
  result.parameters.colliders =
      CheckColliders(environment_path.Child("colliders"), environment.colliders(), limits, checks);
  result.parameters.collider_motions =
      CheckColliderMotions(environment_path.Child("colliders"), environment.colliders(),
                           result.parameters.colliders, checks);
  CheckSurfaceMaterial(path.Child("material"), spec.material(), result.parameters, checks);
  result.parameters.settings = CheckSettings(path.Child("settings"), spec.settings(), checks);
  return result;
}

}  // namespace drape::api
