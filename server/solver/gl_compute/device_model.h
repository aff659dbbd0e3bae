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

namespace drape {

// Word offsets of a model's arrays from the start of its range; contents as in
// shaders/interface/cloth_record.h.
struct ModelLayout {
  uint32_t colour_offsets = 0;
  uint32_t pairs = 0;
  uint32_t rest_lengths = 0;
  uint32_t compliances = 0;
  uint32_t kinds = 0;
  uint32_t joint_colour_offsets = 0;
  uint32_t joint_pairs = 0;
  uint32_t joint_compliances = 0;
  uint32_t masses = 0;
  uint32_t inverse_masses = 0;
  uint32_t spring_offsets = 0;
  uint32_t spring_ends = 0;
  uint32_t elastic_elements = 0;
  uint32_t elastic_offsets = 0;
  uint32_t elastic_ends = 0;
  uint32_t pins = 0;
  uint32_t tether_offsets = 0;
  uint32_t tethers = 0;
  uint32_t strip_phases = 0;
  uint32_t strip_offsets = 0;
  uint32_t strip_constraints = 0;
  uint32_t strip_particles = 0;
  uint32_t strip_lengths = 0;
  uint32_t regular_strips = 0;  // only if all are (regular_strips.h)
  // With air forces.
  uint32_t triangles = 0;
  uint32_t triangle_masses = 0;
  uint32_t triangle_offsets = 0;
  uint32_t particle_triangles = 0;
};

struct PackedModel {
  ModelLayout layout;
  std::vector<uint32_t> words;
};

// Pure. The triangles are packed only for cloths with air forces.
PackedModel PackModel(const SceneModel& model, bool has_air_forces = false);

// A model and its words on the device, constant.
struct DeviceModel {
  std::shared_ptr<const SceneModel> model;
  ModelLayout layout;
  WordRange words;
  std::vector<uint32_t> colour_sizes;          // [colour_count] constraints
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
