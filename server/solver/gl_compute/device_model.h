// Scene models on the device: each one once, however many cloths share it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/gl_compute/device_arena.h"
#include "server/solver/gl_compute/strip_rows.h"
#include "server/solver/self_contact/contact_surface.h"
#include "shaders/interface/layouts.h"
#include "shaders/interface/self_contact_record.h"

namespace drape {

// What the cloths of a model need of it.
struct ModelUse {
  bool has_air_forces = false;
  bool has_strip_rows = false;  // strips are solved by work groups or lanes
  // Of a cloth that touches itself, else null. Such a cloth is not resident.
  std::shared_ptr<const ContactSurface> surface{};
};

struct PackedModel {
  shader::ModelLayout layout{};
  StripRows rows;                        // only with strip rows
  shader::SelfContactRecord contacts{};  // counts and places in Models; only with a surface
  std::vector<uint32_t> words;
};

// Pure. The triangles are packed only for cloths with air forces, the surface for those that touch
// themselves.
PackedModel PackModel(const SceneModel& model, const ModelUse& use = {});

// A model and its words on the device, constant.
struct DeviceModel {
  std::shared_ptr<const SceneModel> model;
  shader::ModelLayout layout{};
  shader::SelfContactRecord contacts{};
  std::shared_ptr<const ContactSurface> surface{};  // of cloths that touch themselves
  WordRange words{};
  std::vector<uint32_t> colour_sizes{};        // [colour_count] constraints
  std::vector<uint32_t> joint_colour_sizes{};  // [joint_colour_count] joints
  std::vector<uint32_t> phase_sizes{};         // [strips().phase_count()] strips
  std::vector<uint32_t> phase_blocks{};        // [strips().phase_count()]; only with strip rows
};

// Every call with the context current. The arena must outlive the models.
class ModelStore {
 public:
  explicit ModelStore(DeviceArena* arena) : arena_(arena) {}

  // The device copy of this very model object, uploaded unless some cloth has it already; those
  // of different uses have one each. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::shared_ptr<const DeviceModel>> Acquire(std::shared_ptr<const SceneModel> model,
                                                     const ModelUse& use);

 private:
  DeviceArena* arena_;
  // By model, and whether it is packed for air forces, with strip rows and with its surface.
  std::map<std::tuple<const SceneModel*, bool, bool, bool>, std::weak_ptr<const DeviceModel>>
      models_;
};

}  // namespace drape
