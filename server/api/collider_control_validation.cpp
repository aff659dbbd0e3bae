#include "server/api/collider_control_validation.h"

#include "server/api/geometry_message.h"
#include "server/api/over_column.h"
#include "server/scene/description_checks.h"
#include "server/solver/solver_constants.h"

namespace drape::api {

std::vector<RigidMotion> CheckColliderMotions(
    const FieldPath& path, const google::protobuf::RepeatedPtrField<v1::Collider>& colliders,
    const std::vector<Collider>& shapes, Violations& violations) {
  std::vector<RigidMotion> motions;
  if (static_cast<size_t>(colliders.size()) != shapes.size()) return motions;
  bool is_any_given = false;
  for (size_t k = 0; k < shapes.size(); ++k) {
    const v1::Collider& collider = colliders[static_cast<int>(k)];
    const FieldPath here = path.At(k);
    RigidMotion motion =
        RigidMotion::AtRest(CheckVector3Or(CentreOf(shapes[k]), here.Child("pivot_m"),
                                           collider.pivot_m(), kMaxExtent_m, "m", violations));
    motion.velocity_m_per_s =
        CheckVector3Or(Eigen::Vector3d::Zero(), here.Child("velocity_m_per_s"),
                       collider.velocity_m_per_s(), kMaxColliderSpeed_m_per_s, "m/s", violations);
    motion.angular_velocity_rad_per_s = CheckVector3Or(
        Eigen::Vector3d::Zero(), here.Child("angular_velocity_rad_per_s"),
        collider.angular_velocity_rad_per_s(), kMaxColliderTurn_rad_per_s, "rad/s", violations);
    if (shapes[k].is_body() && !collider.pivot_m().empty()) {
      violations.Add(here.Child("pivot_m"),
                     "must be empty: a collider with a mass turns about its "
                     "centre of mass");
    }
    is_any_given |= shapes[k].is_body() || !collider.pivot_m().empty() ||
                    !motion.velocity_m_per_s.isZero(0) ||
                    !motion.angular_velocity_rad_per_s.isZero(0);
    motions.push_back(motion);
  }
  if (!is_any_given) motions.clear();
  return motions;
}

std::vector<ControlRow<ColliderControl>> CheckColliderControls(const v1::ColliderControls& controls,
                                                               Violations& violations) {
  std::vector<ControlRow<ColliderControl>> result;
  const FieldPath path("collider_controls");
  const size_t rows = controls.cloth_ids_size();
  const DoubleList& rotations = controls.rotations_xyzw();
  const FieldPath positions_path = path.Child("positions_m");
  const FieldPath rotations_path = path.Child("rotations_xyzw");
  const bool is_even =
      violations.Length(path.Child("colliders"), controls.colliders_size(), rows, "1 per row") &
      violations.Length(positions_path, controls.positions_m_size(), 3 * rows, "3 per row") &
      (rotations.empty() ||
       violations.Length(rotations_path, rotations.size(), 4 * rows, "4 per row, or none")) &
      CheckOverColumn(path.Child("over_s"), controls.over_s(), rows, violations);
  if (!is_even ||
      !CheckAllWithin(positions_path, controls.positions_m(), kMaxExtent_m, "m", violations) ||
      !CheckAllWithin(rotations_path, rotations, kMaxMagnitude, "", violations)) {
    return result;
  }
  for (size_t r = 0; r < rows && !violations.is_full(); ++r) {
    const int row = static_cast<int>(r);
    ColliderControl control{.collider = controls.colliders(row)};
    control.target.position_m = Eigen::Vector3d(controls.positions_m().data() + 3 * r);
    if (!rotations.empty()) {
      const Eigen::Vector4d xyzw(rotations.data() + 4 * r);
      control.target.rotation = CheckRotation(rotations_path.At(4 * r), xyzw, violations);
    }
    control.over_s = CheckOver(path.Child("over_s"), controls.over_s(), r, violations);
    result.push_back({ClothId::FromPacked(controls.cloth_ids(row)), control});
  }
  return result;
}

}  // namespace drape::api
