#include "server/scene/body_joint.h"

namespace drape {

using Eigen::Vector3d;

double RopeWay_m(const BodyJoint& rope, const Vector3d& end_m, const Vector3d& other_end_m) {
  double way_m = 0;
  Vector3d last_m = end_m;
  for (const Vector3d& pulley_m : rope.pulleys_m) {
    way_m += (pulley_m - last_m).norm();
    last_m = pulley_m;
  }
  return way_m + (other_end_m - last_m).norm();
}

}  // namespace drape
