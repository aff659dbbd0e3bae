#include "server/scene/pin_motion.h"

namespace drape {

Eigen::Vector3d PinMotion::At(double time_s) const {
  if (IsOver(time_s)) return target_m;
  if (time_s <= start_s) return start_m;
  return start_m + (target_m - start_m) * ((time_s - start_s) / over_s);
}

}  // namespace drape
