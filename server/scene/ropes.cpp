#include "server/scene/ropes.h"

#include "server/scene/body_joint.h"

namespace drape {
namespace {

using Eigen::Vector3d;

// Of a drawn rope, of its length [-].
constexpr double kRopeRadius = 0.0015;

}  // namespace

std::vector<Collider> RopesOf(std::span<const Collider> colliders,
                              std::span<const RigidMotion> motions) {
  std::vector<Collider> parts;
  for (size_t c = 0; c < colliders.size(); ++c) {
    for (const BodyJoint& joint : colliders[c].joints) {
      if (!joint.is_rope()) continue;
      std::vector<Vector3d> along_m{motions[c].PlaceOf(joint.point_m)};
      along_m.insert(along_m.end(), joint.pulleys_m.begin(), joint.pulleys_m.end());
      along_m.push_back(joint.collider ? motions[*joint.collider].PlaceOf(joint.other_point_m)
                                       : joint.other_point_m);
      for (size_t k = 1; k < along_m.size(); ++k) {
        parts.push_back(
            CapsuleBetween(along_m[k - 1], along_m[k], kRopeRadius * *joint.rope_length_m));
      }
    }
  }
  return parts;
}

}  // namespace drape
