// Distance maps on the device: each one once, however many cloths share it.
#pragma once

#include <map>
#include <memory>

#include "server/core/status.h"
#include "server/scene/distance_map.h"
#include "server/solver/gl_compute/device_arena.h"

namespace drape {

// A map's header and samples in Models (shaders/interface/bindings.h), constant.
struct DeviceMap {
  std::shared_ptr<const DistanceMap> map;
  WordRange words;
};

// Every call with the context current. The arena must outlive the maps.
class MapStore {
 public:
  explicit MapStore(DeviceArena* arena) : arena_(arena) {}

  // The device copy of this very map object, uploaded unless some cloth has it already.
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::shared_ptr<const DeviceMap>> Acquire(std::shared_ptr<const DistanceMap> map);

 private:
  DeviceArena* arena_;
  std::map<const DistanceMap*, std::weak_ptr<const DeviceMap>> maps_;
};

}  // namespace drape
