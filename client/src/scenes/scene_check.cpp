#include "client/src/scenes/scene_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "client/src/errors.h"
#include "drape/scene_file.h"

namespace drape {
inline namespace client {
namespace {

// Largest number of steps: beyond it, step counts and times lose their meaning in double precision.
constexpr double kMaxSteps = 1e12;
// Largest number of cloths: more than any server holds; bounds the copies that the client itself
// makes.
constexpr uint64_t kMaxCloths = 1'000'000;
constexpr uint64_t kMaxParticles = 1u << 24;  // of one cloth

void CheckFinite(double value, const std::string& field) {
  if (!std::isfinite(value)) throw BadField(field, "must be finite, got " + NumberText(value));
}

void CheckNotNegative(double value, const std::string& field) {
  if (!(value >= 0) || !std::isfinite(value)) {
    throw BadField(field, "must be >= 0, got " + NumberText(value));
  }
}

void CheckPositive(double value, const std::string& field) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw BadField(field, "must be > 0, got " + NumberText(value));
  }
}

void CheckVector(const google::protobuf::RepeatedField<double>& vector, bool may_be_empty,
                 const std::string& field) {
  if (!(may_be_empty && vector.empty()) && vector.size() != 3) {
    throw BadField(field, "must have 3 numbers, got " + std::to_string(vector.size()));
  }
  for (int axis = 0; axis < vector.size(); ++axis) {
    CheckFinite(vector[axis], field + "[" + std::to_string(axis) + "]");
  }
}

void CheckCloths(const v1::Scene& scene) {
  if (scene.cloths().empty()) throw BadField("cloths", "must have at least one cloth");
  uint64_t cloth_count = 0;
  for (int k = 0; k < scene.cloths_size(); ++k) {
    const v1::SceneCloth& cloth = scene.cloths(k);
    const std::string path = "cloths[" + std::to_string(k) + "]";
    if (cloth.has_count() && cloth.count() == 0) {
      throw BadField(path + ".count", "must be at least 1, got 0");
    }
    cloth_count += cloth.has_count() ? cloth.count() : 1;
    if (cloth_count > kMaxCloths) {
      throw BadField(path + ".count", "makes more than " + std::to_string(kMaxCloths) + " cloths");
    }
    CheckFinite(cloth.spacing_m(), path + ".spacing_m");
    if (cloth.spec().topology_case() == v1::ClothSpec::TOPOLOGY_NOT_SET) {
      throw BadField(path + ".spec", "must have one of grid, mesh, mesh_file and particles");
    }
    const v1::Grid& grid = cloth.spec().grid();
    if (uint64_t{grid.columns()} * grid.rows() > kMaxParticles) {
      throw BadField(path + ".spec.grid",
                     "makes more than " + std::to_string(kMaxParticles) + " particles");
    }
  }
}

bool HasPin(const v1::ClothSpec& spec, uint32_t particle) {
  return std::any_of(spec.pins().begin(), spec.pins().end(),
                     [particle](const v1::Pin& pin) { return pin.particle() == particle; });
}

// The entries of scene.cloths that a control moves.
std::vector<int> ControlledEntries(const v1::Scene& scene, const v1::SceneControl& control) {
  std::vector<int> entries;
  uint64_t first = 0;
  for (int k = 0; k < scene.cloths_size(); ++k) {
    const uint64_t next = first + (scene.cloths(k).has_count() ? scene.cloths(k).count() : 1);
    const bool is_controlled =
        control.cloths().empty() ||
        std::any_of(control.cloths().begin(), control.cloths().end(),
                    [&](uint32_t index) { return index >= first && index < next; });
    if (is_controlled) entries.push_back(k);
    first = next;
  }
  return entries;
}

void CheckPinTarget(const v1::Scene& scene, const v1::SceneControl& control,
                    const v1::PinTarget& target, const std::string& path) {
  CheckVector(target.target_m(), /*may_be_empty=*/false, path + ".target_m");
  CheckNotNegative(target.over_s(), path + ".over_s");
  for (const int k : ControlledEntries(scene, control)) {
    if (HasPin(scene.cloths(k).spec(), target.particle())) continue;
    throw BadField(path + ".particle", "particle " + std::to_string(target.particle()) +
                                           " is not a pin of cloths[" + std::to_string(k) + "]");
  }
}

void CheckColliderTarget(const v1::Scene& scene, const v1::SceneControl& control,
                         const v1::ColliderTarget& target, const std::string& path) {
  CheckVector(target.position_m(), /*may_be_empty=*/false, path + ".position_m");
  const auto& xyzw = target.rotation_xyzw();
  if (!xyzw.empty() && xyzw.size() != 4) {
    throw BadField(path + ".rotation_xyzw",
                   "must have 4 numbers or none, got " + std::to_string(xyzw.size()));
  }
  for (int k = 0; k < xyzw.size(); ++k) {
    CheckFinite(xyzw[k], path + ".rotation_xyzw[" + std::to_string(k) + "]");
  }
  CheckNotNegative(target.over_s(), path + ".over_s");
  for (const int k : ControlledEntries(scene, control)) {
    const int count = scene.cloths(k).spec().environment().colliders_size();
    if (target.collider() < static_cast<uint32_t>(count)) continue;
    throw BadField(path + ".collider", "collider " + std::to_string(target.collider()) +
                                           " is not one of the " + std::to_string(count) +
                                           " of cloths[" + std::to_string(k) + "]");
  }
}

void CheckAction(v1::GripControls::Action action, const std::string& path) {
  const google::protobuf::EnumDescriptor& actions = *v1::GripControls::Action_descriptor();
  if (action != 0 && actions.FindValueByNumber(action) != nullptr) return;
  std::string names;
  for (int k = 0; k < actions.value_count(); ++k) {
    if (actions.value(k)->number() == 0) continue;
    names += (names.empty() ? "" : ", ") + actions.value(k)->name();
  }
  throw BadField(
      path, "must be one of " + names + ", got " + (action == 0 ? "none" : std::to_string(action)));
}

void CheckGripTarget(const v1::Scene& scene, const v1::SceneControl& control,
                     const v1::GripTarget& target, const std::string& path) {
  CheckAction(target.action(), path + ".action");
  const bool is_release = target.action() == v1::GripControls::RELEASE;
  CheckVector(target.target_m(), /*may_be_empty=*/is_release, path + ".target_m");
  CheckNotNegative(target.over_s(), path + ".over_s");
  CheckNotNegative(target.largest_force_n(), path + ".largest_force_n");
  if (target.action() == v1::GripControls::GRAB_NEAREST) {
    CheckPositive(target.radius_m(), path + ".radius_m");
  }
  for (const int k : ControlledEntries(scene, control)) {
    const uint32_t count = scene.cloths(k).spec().max_grips();
    if (target.slot() < count) continue;
    throw BadField(path + ".slot", "must be below max_grips of cloths[" + std::to_string(k) +
                                       "], " + std::to_string(count) + ", got " +
                                       std::to_string(target.slot()));
  }
}

void CheckControl(const v1::Scene& scene, const v1::SceneControl& control,
                  const std::string& path) {
  CheckNotNegative(control.time_s(), path + ".time_s");
  CheckVector(control.gravity_m_per_s2(), /*may_be_empty=*/true, path + ".gravity_m_per_s2");
  CheckVector(control.wind_m_per_s(), /*may_be_empty=*/true, path + ".wind_m_per_s");
  const uint64_t cloth_count = ClothCount(scene);
  for (int i = 0; i < control.cloths_size(); ++i) {
    if (control.cloths(i) < cloth_count) continue;
    throw BadField(path + ".cloths[" + std::to_string(i) + "]",
                   "must be below the number of cloths, " + std::to_string(cloth_count) + ", got " +
                       std::to_string(control.cloths(i)));
  }
  // The server is told of these once for each cloth.
  const bool has_load = control.gravity_m_per_s2_size() > 0 || control.wind_m_per_s_size() > 0;
  std::set<uint64_t> told;
  for (int i = 0; has_load && i < control.cloths_size(); ++i) {
    if (told.insert(control.cloths(i)).second) continue;
    throw BadField(path + ".cloths[" + std::to_string(i) + "]",
                   std::to_string(control.cloths(i)) + " is given twice");
  }
  for (int i = 0; i < control.rest_lengths_size(); ++i) {
    const std::string target = path + ".rest_lengths[" + std::to_string(i) + "]";
    CheckPositive(control.rest_lengths(i).rest_length_m(), target + ".rest_length_m");
    CheckNotNegative(control.rest_lengths(i).over_s(), target + ".over_s");
  }
  if (control.has_rest_length_scale()) {
    CheckPositive(control.rest_length_scale().scale(), path + ".rest_length_scale.scale");
    CheckNotNegative(control.rest_length_scale().over_s(), path + ".rest_length_scale.over_s");
  }
  for (int i = 0; i < control.collider_targets_size(); ++i) {
    CheckColliderTarget(scene, control, control.collider_targets(i),
                        path + ".collider_targets[" + std::to_string(i) + "]");
  }
  for (int i = 0; i < control.grips_size(); ++i) {
    CheckGripTarget(scene, control, control.grips(i), path + ".grips[" + std::to_string(i) + "]");
  }
  for (int i = 0; i < control.pin_targets_size(); ++i) {
    CheckPinTarget(scene, control, control.pin_targets(i),
                   path + ".pin_targets[" + std::to_string(i) + "]");
  }
}

}  // namespace

void CheckScene(const v1::Scene& scene) {
  if (!(scene.time_step_s() > 0) || !std::isfinite(scene.time_step_s())) {
    throw BadField("time_step_s", "must be > 0, got " + NumberText(scene.time_step_s()));
  }
  CheckNotNegative(scene.duration_s(), "duration_s");
  if (scene.duration_s() / scene.time_step_s() > kMaxSteps) {
    throw BadField("duration_s", "must be at most 10^12 steps");
  }
  CheckCloths(scene);
  for (int i = 0; i < scene.controls_size(); ++i) {
    CheckControl(scene, scene.controls(i), "controls[" + std::to_string(i) + "]");
  }
}

}  // namespace client
}  // namespace drape
