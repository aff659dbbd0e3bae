#include "server/api/grip_control_validation.h"

#include <optional>
#include <string>

#include "server/api/over_column.h"
#include "server/scene/description_checks.h"

namespace drape::api {
namespace {

bool CheckColumn(const FieldPath& path, size_t size, size_t rows, Violations& violations) {
  return size == 0 || violations.Length(path, size, rows, "1 per row, or none");
}

bool CheckColumns(const FieldPath& path, const v1::GripControls& controls, size_t rows,
                  Violations& violations) {
  return violations.Length(path.Child("slots"), controls.slots_size(), rows, "1 per row") &
         violations.Length(path.Child("actions"), controls.actions_size(), rows, "1 per row") &
         violations.Length(path.Child("targets_m"), controls.targets_m_size(), 3 * rows,
                           "3 per row") &
         CheckColumn(path.Child("particles"), controls.particles_size(), rows, violations) &
         CheckColumn(path.Child("radii_m"), controls.radii_m_size(), rows, violations) &
         CheckColumn(path.Child("largest_forces_n"), controls.largest_forces_n_size(), rows,
                     violations) &
         CheckOverColumn(path.Child("over_s"), controls.over_s(), rows, violations);
}

std::optional<GripAction> ActionOf(int action) {
  switch (action) {
    case v1::GripControls::HOLD:
      return GripAction::kHold;
    case v1::GripControls::GRAB_PARTICLE:
      return GripAction::kGrabParticle;
    case v1::GripControls::GRAB_NEAREST:
      return GripAction::kGrabNearest;
    case v1::GripControls::RELEASE:
      return GripAction::kRelease;
    default:
      return std::nullopt;
  }
}

GripAction CheckAction(const FieldPath& path, int action, Violations& violations) {
  const std::optional<GripAction> known = ActionOf(action);
  violations.Require(known.has_value(), path, [&] {
    return std::to_string(action) +
           " is none of HOLD (1), GRAB_PARTICLE (2), GRAB_NEAREST (3), RELEASE (4)";
  });
  return known.value_or(GripAction::kRelease);
}

}  // namespace

std::vector<ControlRow<GripControl>> CheckGripControls(const v1::GripControls& controls,
                                                       Violations& violations) {
  std::vector<ControlRow<GripControl>> result;
  const FieldPath path("grip_controls");
  const size_t rows = controls.cloth_ids_size();
  if (!CheckColumns(path, controls, rows, violations)) return result;
  CheckAllWithin(path.Child("targets_m"), controls.targets_m(), kMaxExtent_m, "m", violations);
  for (size_t r = 0; r < rows && !violations.is_full(); ++r) {
    const int row = static_cast<int>(r);
    const double* place = controls.targets_m().data() + 3 * r;
    GripControl control{
        .slot = controls.slots(row),
        .place_m = {place[0], place[1], place[2]},
        .over_s = CheckOver(path.Child("over_s"), controls.over_s(), r, violations)};
    control.action = CheckAction(path.Child("actions").At(r), controls.actions(row), violations);
    if (!controls.particles().empty()) control.particle = controls.particles(row);
    if (!controls.radii_m().empty()) control.radius_m = controls.radii_m(row);
    const bool is_search = control.action == GripAction::kGrabNearest;
    violations.InRange(path.Child("radii_m").At(r), control.radius_m,
                       is_search ? Positive(kMaxExtent_m, "m") : Range{0, kMaxExtent_m, "m"});
    if (!controls.largest_forces_n().empty()) {
      const double force_n = controls.largest_forces_n(row);
      violations.InRange(path.Child("largest_forces_n").At(r), force_n, {0, kMaxGripForce_n, "N"});
      if (force_n > 0) control.largest_force_n = force_n;
    }
    result.push_back({ClothId::FromPacked(controls.cloth_ids(row)), control});
  }
  return result;
}

}  // namespace drape::api
