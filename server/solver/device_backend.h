// The additional interface of backends whose cloths live in the memory of a device.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "server/solver/backend.h"

namespace drape {

// States in the device's memory. Opaque: server/gl defines it for the backend that makes copies and
// the renderer that draws them.
struct DeviceCopy;

// States on their way to the host. Device thread; destroyed before the backend.
class PendingRead {
 public:
  virtual ~PendingRead() = default;
  // Waits until the states have arrived. Call it once.
  virtual StateColumns Take() = 0;
};

// A read whose states are there already.
class CompletedRead final : public PendingRead {
 public:
  explicit CompletedRead(StateColumns columns) : columns_(std::move(columns)) {}
  StateColumns Take() override { return std::move(columns_); }

 private:
  StateColumns columns_;
};

// Implemented by gl_compute alone. Callers get it from Backend::device(); without one they use Step
// and Read, which cost the same there.
class DeviceBackend : public Backend {
 public:
  // Whether the device works while the host does something else. If not, use Step.
  virtual bool RunsAhead() const = 0;
  // StepUntil for at least one item. If RunsAhead(), calls `meanwhile` once before it waits for the
  // device; `meanwhile` may take pending reads and must not call the backend otherwise.
  virtual BatchReport StepAhead(std::span<const StepItem> items, const Pause& pause,
                                const std::function<void()>& meanwhile) = 0;
  // Whether steps can measure cloths at once, and tell the impulses of this one. False: what that
  // takes is being made beside the device thread, since the first call; ask again. A step that does
  // not wait for it makes it itself, which may take seconds.
  virtual bool IsReadyToMeasure() { return true; }
  virtual bool IsReadyToTellImpulses(ClothHandle /*cloth*/) { return true; }
  // The states that Read would return now, whatever is stepped, written or destroyed before they
  // are taken.
  virtual std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request) = 0;
  // Copies the columns (float32: all positions, then all velocities) on the device, for another
  // context of its share group. Nothing passes through the host and nobody waits. Whole cloths
  // only: `request.particles` is empty. Null if the device has no room: use Read.
  virtual std::shared_ptr<DeviceCopy> CopyOnDevice(const ReadRequest& request) = 0;

 protected:
  DeviceBackend() : Backend(this) {}
};

// BeginRead of the device; without a device, a completed Read.
std::unique_ptr<PendingRead> BeginRead(Backend& backend, const ReadRequest& request);

}  // namespace drape
