#include "server/api/self_collision_message.h"

#include "server/scene/description_checks.h"

namespace drape::api {

std::optional<SelfCollision> CheckSelfCollision(const FieldPath& path, const v1::ClothSpec& spec,
                                                Violations& violations) {
  if (!spec.has_self_collision()) return std::nullopt;
  violations.Require(!spec.has_particles(), path, [] {
    return "belongs to cloths with triangles, made of a grid or a mesh; must be unset here";
  });
  const v1::SelfCollision& message = spec.self_collision();
  SelfCollision result;
  if (message.has_thickness_m()) {
    result.thickness_m = message.thickness_m();
    violations.InRange(path.Child("thickness_m"), *result.thickness_m, Positive(kMaxExtent_m, "m"));
  }
  if (message.has_friction_static()) {
    result.friction_static = message.friction_static();
    violations.InRange(path.Child("friction_static"), *result.friction_static,
                       {0, kMaxCoefficient});
  }
  if (message.has_friction_dynamic()) {
    result.friction_dynamic = message.friction_dynamic();
    violations.InRange(path.Child("friction_dynamic"), *result.friction_dynamic,
                       {0, kMaxCoefficient});
  }
  return result;
}

}  // namespace drape::api
