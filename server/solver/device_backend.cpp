#include "server/solver/device_backend.h"

namespace drape {

std::unique_ptr<PendingRead> BeginRead(Backend& backend, const ReadRequest& request) {
  if (DeviceBackend* device = backend.device()) return device->BeginRead(request);
  return std::make_unique<CompletedRead>(backend.Read(request));
}

}  // namespace drape
