#include "server/core/device_loss.h"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <mutex>

namespace drape {
namespace {

// Of the process, like its signals: a lost device ends all servers in it.
std::mutex mutex;
std::function<void(const std::string&)> on_loss;
std::atomic<int64_t> patience_s = 0;

}  // namespace

void LoseDevice(const std::string& reason) {
  const std::lock_guard lock(mutex);
  std::fprintf(stderr, "the device is lost: %s\n", reason.c_str());
  if (on_loss) on_loss(reason);
  std::abort();
}

void OnDeviceLoss(std::function<void(const std::string&)> handler) {
  const std::lock_guard lock(mutex);
  on_loss = std::move(handler);
}

void SetDevicePatience(std::chrono::seconds patience) {
  patience_s = patience.count();
}

std::chrono::seconds DevicePatience() {
  return std::chrono::seconds(patience_s.load());
}

}  // namespace drape
