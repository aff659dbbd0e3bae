#include "server/scheduler/step_work.h"

namespace drape {

ClothStamp StampOf(const ClothRuntime& cloth) {
  const ClothProgress& now = cloth.now();
  return {now.completed_steps, now.time_s, now.fault};
}

}  // namespace drape
