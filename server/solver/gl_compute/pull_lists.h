// Which links pull on which particle, on the device: for what the impulses of a step on what is
// held are added up from. Each model's once, however many of its cloths are asked.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/device_arena.h"

namespace drape {

// The vectors of a model: one per constraint, then per joint, then per tether.
uint64_t CountPullVectors(const SceneModel& model);

// Pure. [particle_count + 1] where the list of each particle begins, counted from the first entry;
// then the entries (DRAPE_IMPULSE_LISTS).
std::vector<uint32_t> PackPullLists(const SceneModel& model);

// Constant.
struct DevicePullLists {
  std::shared_ptr<const SceneModel> model;
  WordRange words;  // in Models
};

// Every call with the context current. The arena must outlive the lists.
class PullListStore {
 public:
  explicit PullListStore(DeviceArena* arena) : arena_(arena) {}

  // Those of this very model object, uploaded unless some cloth has them already.
  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::shared_ptr<const DevicePullLists>> Acquire(std::shared_ptr<const SceneModel> model);

 private:
  DeviceArena* arena_;
  std::map<const SceneModel*, std::weak_ptr<const DevicePullLists>> lists_;
};

}  // namespace drape
