#include "server/api/lock_checks.h"

#include <absl/synchronization/mutex.h>

namespace drape::api {

void SkipLockChecks() {
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
}

}  // namespace drape::api
