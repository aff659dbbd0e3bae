#include "server/api/request_validation.h"

#include "server/api/collider_control_validation.h"

#include <google/protobuf/field_mask.pb.h>

#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string_view>

#include "server/api/collider_message.h"
#include "server/api/connection_validation.h"
#include "server/api/field_checks.h"
#include "server/api/geometry_message.h"
#include "server/api/grip_control_validation.h"
#include "server/api/material_message.h"
#include "server/api/over_column.h"
#include "server/api/rest_length_validation.h"
#include "server/api/self_collision_message.h"
#include "server/api/settings_message.h"
#include "server/api/spec_validation.h"
#include "server/api/start_validation.h"
#include "server/api/topology_validation.h"
#include "server/api/view_validation.h"
#include "server/core/text.h"
#include "server/scene/description_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

// The world is larger than a cloth: its origins are added in double precision only.
constexpr double kMaxOrigin_m = 1e12;

bool CheckColumn(const FieldPath& path, const DoubleList& values, size_t rows, size_t per_row,
                 double max, std::string_view meaning, Violations& violations) {
  if (values.empty()) return false;
  return violations.Length(path, values.size(), rows * per_row, meaning) &&
         CheckAllWithin(path, values, max, per_row == 3 ? "m" : "", violations);
}

void ApplyTransforms(const v1::CreateClothsRequest& request, std::vector<ClothCopy>& copies,
                     Violations& violations) {
  const std::vector<RigidTransform> transforms =
      CheckTransforms(FieldPath("transforms"), request.transforms(), copies.size(), violations);
  for (size_t k = 0; k < transforms.size(); ++k) copies[k].transform = transforms[k];
}

void ApplyOrigins(const v1::CreateClothsRequest& request, std::vector<ClothCopy>& copies,
                  Violations& violations) {
  const DoubleList& origins_m = request.environment_origins_m();
  if (!CheckColumn(FieldPath("environment_origins_m"), origins_m, copies.size(), 3, kMaxOrigin_m,
                   "3 per copy", violations)) {
    return;
  }
  for (size_t k = 0; k < copies.size(); ++k) {
    const double* row = origins_m.data() + 3 * k;
    copies[k].environment_origin_m = {row[0], row[1], row[2]};
  }
}

// `base`: the settings of the spec.
void ApplyOverride(const FieldPath& path, const v1::StepSettings& base,
                   const v1::ClothOverride& override_, ClothParameters& parameters,
                   Violations& violations) {
  parameters.gravity_m_per_s2 =
      CheckGravity(path.Child("gravity_m_per_s2"), override_.gravity_m_per_s2(),
                   parameters.gravity_m_per_s2, violations);
  parameters.wind_m_per_s = CheckWind(path.Child("wind_m_per_s"), override_.wind_m_per_s(),
                                      parameters.wind_m_per_s, violations);
  if (override_.has_settings()) {
    v1::StepSettings merged = base;
    merged.MergeFrom(override_.settings());
    parameters.settings = CheckSettings(path.Child("settings"), merged, violations);
  }
  CheckSurfaceOverride(path, override_, parameters, violations);
}

void ApplyOverrides(const v1::CreateClothsRequest& request, std::vector<ClothCopy>& copies,
                    Violations& violations) {
  const FieldPath path("overrides");
  if (request.overrides().empty() ||
      !violations.Length(path, request.overrides_size(), copies.size(), "1 per copy")) {
    return;
  }
  // Violations of the spec's own settings are not repeated for every copy.
  Violations spec_violations;
  CheckSettings(FieldPath("spec"), request.spec().settings(), spec_violations);
  v1::StepSettings base =
      spec_violations.is_empty() ? request.spec().settings() : v1::StepSettings();
  base.DiscardUnknownFields();  // up to 60 MB, which each copy would get
  for (size_t k = 0; k < copies.size() && !violations.is_full(); ++k) {
    ApplyOverride(path.At(k), base, request.overrides(static_cast<int>(k)), copies[k].parameters,
                  violations);
  }
}

// Reads the part of `spec` that a path of an update mask names.
using ReadPath =
    std::function<void(const v1::ClothSpec&, const RequestLimits&, ClothChange&, Violations&)>;

// The paths that name one number of the material, read by the tables.
void AddMaterialPaths(std::map<std::string, ReadPath, std::less<>>& paths) {
  static const FieldPath kMaterial = FieldPath("spec").Child("material");
  const auto read = [](const auto& field, const v1::ClothSpec& spec, auto& numbers,
                       Violations& violations) {
    const double value = NumberOf(spec.material(), field.name);
    violations.InRange(kMaterial.Child(field.name), value, field.range);
    numbers.Set(field.member, value);
  };
  for (const StructuralField& field : kStructuralFields) {
    if (!field.may_change) continue;
    paths["material." + std::string(field.name)] =
        [&field, read](const auto& spec, const auto&, ClothChange& change, Violations& violations) {
          read(field, spec, change.model.material, violations);
        };
  }
  for (const SurfaceField& field : kSurfaceFields) {
    paths["material." + std::string(field.name)] =
        [&field, read](const auto& spec, const auto&, ClothChange& change, Violations& violations) {
          read(field, spec, change.numbers, violations);
        };
  }
}

// The other paths.
void AddOtherPaths(std::map<std::string, ReadPath, std::less<>>& paths) {
  static const FieldPath kSpec("spec");
  static const FieldPath kEnvironment = kSpec.Child("environment");
  paths["environment.gravity_m_per_s2"] = [](const auto& spec, const auto&, ClothChange& change,
                                             Violations& violations) {
    change.gravity_m_per_s2 =
        CheckGravity(kEnvironment.Child("gravity_m_per_s2"), spec.environment().gravity_m_per_s2(),
                     ClothParameters().gravity_m_per_s2, violations);
  };
  paths["environment.wind_m_per_s"] = [](const auto& spec, const auto&, ClothChange& change,
                                         Violations& violations) {
    change.wind_m_per_s =
        CheckWind(kEnvironment.Child("wind_m_per_s"), spec.environment().wind_m_per_s(),
                  ClothParameters().wind_m_per_s, violations);
  };
  paths["environment.colliders"] = [](const auto& spec, const auto& limits, ClothChange& change,
                                      Violations& violations) {
    const FieldPath path = kEnvironment.Child("colliders");
    change.colliders = CheckColliders(path, spec.environment().colliders(), limits, violations);
    change.collider_motions =
        CheckColliderMotions(path, spec.environment().colliders(), *change.colliders, violations);
  };
  paths["pins"] = [](const auto& spec, const auto&, ClothChange& change, Violations& violations) {
    change.pins = CheckPinTargets(kSpec.Child("pins"), spec.pins(), violations);
  };
  paths["settings"] = [](const auto& spec, const auto&, ClothChange& change,
                         Violations& violations) {
    change.settings = CheckSettings(kSpec.Child("settings"), spec.settings(), violations);
  };
  paths["self_collision"] = [](const auto& spec, const auto&, ClothChange& change,
                               Violations& violations) {
    change.self_collision = CheckSelfCollision(kSpec.Child("self_collision"), spec, violations);
  };
  paths["particles.distance_constraints"] = [](const auto& spec, const auto&, ClothChange& change,
                                               Violations& violations) {
    change.model.distance_constraints =
        CheckNewConstraints(kSpec.Child("particles"), spec.particles(), violations);
  };
  paths["particles.springs"] = [](const auto& spec, const auto&, ClothChange& change,
                                  Violations& violations) {
    change.model.springs = CheckNewSprings(kSpec.Child("particles"), spec.particles(), violations);
  };
  paths["particles.point_joints"] = [](const auto& spec, const auto&, ClothChange& change,
                                       Violations&) {
    change.model.point_joints = ReadJoints(spec.particles());
  };
}

const std::map<std::string, ReadPath, std::less<>>& UpdatePaths() {
  static const auto kPaths = [] {
    std::map<std::string, ReadPath, std::less<>> paths;
    AddMaterialPaths(paths);
    AddOtherPaths(paths);
    return paths;
  }();
  return kPaths;
}

std::string UpdatePathNames() {
  std::string names;
  for (const auto& [name, read] : UpdatePaths()) names += (names.empty() ? "" : ", ") + name;
  return names;
}

void CheckExtent(const v1::StepRequest& request, uint32_t max_steps, CheckedStep& result,
                 Violations& violations) {
  switch (request.extent_case()) {
    case v1::StepRequest::kSteps:
      violations.CountInRange(FieldPath("steps"), request.steps(), 1, max_steps);
      result.steps = request.steps();
      break;
    case v1::StepRequest::kUntilStep:
      result.until_step = request.until_step();
      break;
    case v1::StepRequest::EXTENT_NOT_SET:
      violations.Add(FieldPath("steps"), "neither steps nor until_step is set: one is needed");
      break;
  }
}

void CheckPinControls(const v1::PinControls& controls, CheckedStep& result,
                      Violations& violations) {
  const FieldPath path("pin_controls");
  const size_t rows = controls.cloth_ids_size();
  const bool is_even =
      violations.Length(path.Child("particles"), controls.particles_size(), rows, "1 per row") &
      violations.Length(path.Child("targets_m"), controls.targets_m_size(), 3 * rows, "3 per row") &
      CheckOverColumn(path.Child("over_s"), controls.over_s(), rows, violations);
  if (!is_even) return;
  CheckAllWithin(path.Child("targets_m"), controls.targets_m(), kMaxExtent_m, "m", violations);
  for (size_t r = 0; r < rows; ++r) {
    const int row = static_cast<int>(r);
    const double* target = controls.targets_m().data() + 3 * r;
    const double over_s = CheckOver(path.Child("over_s"), controls.over_s(), r, violations);
    result.controls.pins.push_back(
        {ClothId::FromPacked(controls.cloth_ids(row)),
         {controls.particles(row), {target[0], target[1], target[2]}, over_s}});
  }
}

template <class Request>
ClothStarts CheckStarts(const FieldPath& path, const Request& request, Violations& violations) {
  const auto rows = static_cast<size_t>(request.cloth_ids_size());
  return {CheckTransforms(path.Child("transforms"), request.transforms(), rows, violations),
          CheckParameterOverrides(path.Child("overrides"), request.overrides(), rows, violations)};
}

CheckedLoads CheckLoads(const v1::StepLoads& loads, Violations& violations) {
  CheckedLoads result;
  const int count = loads.cloth_ids_size();
  const int saved = loads.saved_cloth_ids_size();
  violations.Require(saved == 0 || saved == count, FieldPath("loads").Child("saved_cloth_ids"),
                     [&] {
                       return "has " + std::to_string(saved) + " entries; it is empty or has one " +
                              "per cloth (" + std::to_string(count) + ")";
                     });
  if (count == 0) return result;
  CheckSavedName(FieldPath("loads").Child("name"), loads.name(), violations);
  result.name = loads.name();
  result.cloths = ToClothIds(loads.cloth_ids());
  result.saved = ToClothIds(loads.saved_cloth_ids());
  return result;
}

}  // namespace

Result<CheckedCreation> CheckCreateCloths(const v1::CreateClothsRequest& request,
                                          const RequestLimits& limits) {
  Violations violations;
  const uint32_t count = request.has_count() ? request.count() : 1;
  const bool has_count =
      violations.CountInRange(FieldPath("count"), count, 1, limits.max_cloths_per_request);
  CheckedSpec spec = CheckSpec(FieldPath("spec"), request.spec(), limits, violations);
  const size_t colliders = spec.parameters.colliders.size();
  const bool has_room = violations.Require(
      colliders * count <= limits.max_colliders_per_request || !has_count, FieldPath("count"), [&] {
        return std::to_string(count) + " copies of " + std::to_string(colliders) +
               " colliders, at most " + std::to_string(limits.max_colliders_per_request) +
               " colliders are allowed in one request";
      });
  CheckedCreation result;
  result.world = CheckWorldName(FieldPath("world"), request.world(), violations);
  if (has_count && has_room) {
    spec.parameters.is_in_world = !result.world.empty();
    result.copies.assign(count, {spec.transform, Eigen::Vector3d::Zero(), spec.parameters});
    ApplyOrigins(request, result.copies, violations);
    ApplyTransforms(request, result.copies, violations);
    ApplyOverrides(request, result.copies, violations);
  }
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  result.description = std::make_shared<const ModelDescription>(std::move(spec.description));
  result.pins = std::move(spec.pins);
  result.settings = spec.parameters.settings;
  return result;
}

Result<ClothChange> CheckUpdateCloths(const v1::UpdateClothsRequest& request,
                                      const RequestLimits& limits) {
  Violations violations;
  ClothChange change;
  const FieldPath path = FieldPath("update_mask").Child("paths");
  if (request.update_mask().paths().empty() && request.overrides().empty()) {
    violations.Add(path, "is empty: at least one of " + UpdatePathNames() + " is needed");
  }
  std::set<std::string_view> seen;  // reading a path again would cost as much again
  for (int k = 0; k < request.update_mask().paths_size() && !violations.is_full(); ++k) {
    const std::string& name = request.update_mask().paths(k);
    const auto entry = UpdatePaths().find(name);
    if (violations.Require(
            entry != UpdatePaths().end(), path.At(k),
            [&] { return "'" + Shortened(name, 64) + "' is not one of " + UpdatePathNames(); }) &&
        violations.Require(seen.insert(name).second, path.At(k),
                           [&] { return "'" + name + "' occurs twice"; })) {
      entry->second(request.spec(), limits, change, violations);
    }
  }
  violations.AddAll(CheckNamesCloths(request.cloth_ids()).violations());
  change.overrides =
      CheckParameterOverrides(FieldPath("overrides"), request.overrides(),
                              static_cast<size_t>(request.cloth_ids_size()), violations);
  const size_t colliders = change.colliders ? change.colliders->size() : 0;
  const size_t cloths = static_cast<size_t>(request.cloth_ids_size());
  violations.Require(
      colliders * cloths <= limits.max_colliders_per_request, FieldPath("cloth_ids"), [&] {
        return std::to_string(cloths) + " cloths of " + std::to_string(colliders) +
               " colliders, at most " + std::to_string(limits.max_colliders_per_request) +
               " colliders are allowed in one request";
      });
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return change;
}

Result<CheckedReset> CheckReset(const v1::ResetClothsRequest& request) {
  Violations violations;
  CheckedReset result;
  result.cloths = CheckSelection(request, FieldPath(), violations);
  violations.Require(
      !request.all_cloths() || (request.transforms().empty() && request.overrides().empty()),
      FieldPath("all_cloths"),
      [] { return std::string("does not say which row is whose: name the cloths"); });
  result.starts = CheckStarts(FieldPath(), request, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return result;
}

void CheckSavedName(const FieldPath& path, const std::string& name, Violations& violations) {
  constexpr size_t kMaxNameBytes = 128;
  violations.Require(!name.empty() && name.size() <= kMaxNameBytes, path, [&] {
    return "has " + std::to_string(name.size()) + " bytes; legal: 1 to " +
           std::to_string(kMaxNameBytes);
  });
}

Result<CheckedStep> CheckStep(const v1::StepRequest& request, uint32_t max_steps_per_request) {
  Violations violations;
  CheckedStep result;
  result.cloths = CheckSelection(request, FieldPath(), violations);
  CheckExtent(request, max_steps_per_request, result, violations);
  if (request.has_expected_step()) result.expected_step = request.expected_step();
  CheckPinControls(request.pin_controls(), result, violations);
  result.controls.colliders = CheckColliderControls(request.collider_controls(), violations);
  result.controls.lengths = CheckLengthControls(request.rest_length_controls(), violations);
  result.controls.length_scales = CheckLengthScales(request.rest_length_scales(), violations);
  result.resets.cloths = ToClothIds(request.resets().cloth_ids());
  result.resets.starts = CheckStarts(FieldPath("resets"), request.resets(), violations);
  result.loads = CheckLoads(request.loads(), violations);
  result.controls.grips = CheckGripControls(request.grip_controls(), violations);
  if (request.has_view()) result.view = CheckView(FieldPath("view"), request.view(), violations);
  result.report = request.report();
  result.grip_states = request.grip_states();
  result.impulses = request.impulses();
  result.contact_impulses = request.contact_impulses();
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return result;
}

}  // namespace drape::api
