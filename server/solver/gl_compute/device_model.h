// Scene models on the device: each one once, however many cloths share it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/device_arena.h"
#include "shaders/interface/layouts.h"

namespace drape {

struct PackedModel {
  shader::ModelLayout layout{};
  std::vector<uint32_t> words;
};

// Pure. The triangles are packed only for cloths with air forces.
PackedModel PackModel(const SceneModel& model, bool has_air_forces = false);

// A model and its words on the device, constant.
struct DeviceModel {
  std::shared_ptr<const SceneModel> model;
  shader::ModelLayout layout{};
  WordRange words{};
  std::vector<uint32_t> colour_sizes{};        // [colour_count] constraints
  std::vector<uint32_t> joint_colour_sizes{};  // [joint_colour_count] joints
  std::vector<uint32_t> phase_sizes{};         // [strips().phase_count()] strips
};

// Every call with the context current. The arena must outlive the models.
class ModelStore {
 public:
  explicit ModelStore(DeviceArena* arena) : arena_(arena) {}

  // The device copy of this very model object, uploaded unless some cloth has it already; cloths
  // with and without air forces have one each. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::shared_ptr<const DeviceModel>> Acquire(std::shared_ptr<const SceneModel> model,
                                                     bool has_air_forces);

 private:
  DeviceArena* arena_;
  // By model and whether it is packed for air forces.
  std::map<std::pair<const SceneModel*, bool>, std::weak_ptr<const DeviceModel>> models_;
};

}  // namespace drape
