#include "server/api/spec_validation.h"

#include <utility>

#include "server/api/collider_control_validation.h"
#include "server/api/collider_message.h"
#include "server/api/geometry_message.h"
#include "server/api/material_message.h"
#include "server/api/self_collision_message.h"
#include "server/api/settings_message.h"
#include "server/api/topology_validation.h"
#include "server/scene/description_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

// Far above any gravity; a step of 10 s still gives a finite velocity in single precision.
constexpr double kMaxAcceleration_m_per_s2 = 1e12;
// Of the direction of the warp [-].
constexpr double kMinWarpLength = 1e-6;

Eigen::Vector3d CheckWarp(const FieldPath& path, const v1::MeshImport& message, bool has_mesh,
                          Violations& violations) {
  const Eigen::Vector3d fallback = MeshImport().warp_direction;
  violations.Require(message.warp_direction().empty() || has_mesh, path,
                     [] { return "belongs to cloths made of a mesh; must be empty here"; });
  const Eigen::Vector3d direction =
      CheckVector3Or(fallback, path, message.warp_direction(), kMaxExtent_m, "", violations);
  violations.Require(direction.norm() >= kMinWarpLength, path, [&] {
    return "has the length " + NumberText(direction.norm()) + ", must be a direction: at least " +
           NumberText(kMinWarpLength);
  });
  return direction;
}

MeshImport CheckMeshImport(const FieldPath& path, const v1::ClothSpec& spec,
                           Violations& violations) {
  const v1::MeshImport& message = spec.mesh_import();
  const auto require = [&](bool value, const char* field) {
    violations.Require(!value || spec.has_mesh(), path.Child(field),
                       [] { return "true belongs to cloths made of a mesh; must be false here"; });
    return value;
  };
  return {.as_drawn = require(message.as_drawn(), "as_drawn"),
          .keep_lengths = require(message.keep_lengths(), "keep_lengths"),
          .warp_direction =
              CheckWarp(path.Child("warp_direction"), message, spec.has_mesh(), violations)};
}

}  // namespace

std::vector<Pin> CheckPinTargets(const FieldPath& path,
                                 const google::protobuf::RepeatedPtrField<v1::Pin>& pins,
                                 Violations& violations) {
  std::vector<Pin> result;
  for (int k = 0; k < pins.size() && !violations.is_full(); ++k) {
    Pin pin{.particle = pins[k].particle(), .target_m = {}};
    if (!pins[k].target_m().empty()) {
      pin.target_m = CheckVector3(path.At(k).Child("target_m"), pins[k].target_m(), kMaxExtent_m,
                                  "m", violations);
    }
    result.push_back(pin);
  }
  return result;
}

Eigen::Vector3d CheckGravity(const FieldPath& path, const DoubleList& gravity_m_per_s2,
                             const Eigen::Vector3d& fallback, Violations& violations) {
  return CheckVector3Or(fallback, path, gravity_m_per_s2, kMaxAcceleration_m_per_s2, "m/s^2",
                        violations);
}

Eigen::Vector3d CheckWind(const FieldPath& path, const DoubleList& wind_m_per_s,
                          const Eigen::Vector3d& fallback, Violations& violations) {
  return CheckVector3Or(fallback, path, wind_m_per_s, kMaxWind_m_per_s, "m/s", violations);
}

CheckedSpec CheckSpec(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                      Violations& violations) {
  CheckedSpec result;
  result.description.material = ReadStructuralMaterial(spec.material());
  if (spec.has_mesh() && !HasStretch(spec.material())) {
    result.description.material.stretch_stiffness_n_per_m = kMeshStretchStiffness_n_per_m;
  }
  result.description.mesh_import = CheckMeshImport(path.Child("mesh_import"), spec, violations);
  for (const v1::Pin& pin : spec.pins()) {
    result.description.pinned_particles.push_back(pin.particle());
  }
  if (std::optional<Topology> topology = ReadTopology(path, spec, violations)) {
    result.description.topology = std::move(*topology);
    violations.AddAll(CheckDescription(result.description, limits.model), path.ToString() + ".");
  }
  result.pins = CheckPinTargets(path.Child("pins"), spec.pins(), violations);
  CheckClothPart(path, spec, limits, result, violations);
  return result;
}

void CheckClothPart(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                    CheckedSpec& result, Violations& violations) {
  result.transform = CheckTransform(path.Child("transform"), spec.transform(), violations);

  const FieldPath environment_path = path.Child("environment");
  const v1::Environment& environment = spec.environment();
  result.parameters.gravity_m_per_s2 =
      CheckGravity(environment_path.Child("gravity_m_per_s2"), environment.gravity_m_per_s2(),
                   result.parameters.gravity_m_per_s2, violations);
  result.parameters.wind_m_per_s =
      CheckWind(environment_path.Child("wind_m_per_s"), environment.wind_m_per_s(),
                result.parameters.wind_m_per_s, violations);
  result.parameters.colliders = CheckColliders(environment_path.Child("colliders"),
                                               environment.colliders(), limits, violations);
  result.parameters.collider_motions =
      CheckColliderMotions(environment_path.Child("colliders"), environment.colliders(),
                           result.parameters.colliders, violations);
  CheckSurfaceMaterial(path.Child("material"), spec.material(), result.parameters, violations);
  result.parameters.self_collision =
      CheckSelfCollision(path.Child("self_collision"), spec, violations);
  violations.AddAll(CheckSelfFriction(result.parameters), path.ToString() + ".");
  result.parameters.settings = CheckSettings(path.Child("settings"), spec.settings(), violations);
  violations.CountInRange(path.Child("max_grips"), spec.max_grips(), 0, kMaxGrips);
  result.parameters.max_grips = spec.max_grips();
}

}  // namespace drape::api
