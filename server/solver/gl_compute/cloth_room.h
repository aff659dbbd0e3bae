// The room on the device that a cloth needs: kernels, model, memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/core/status.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/gl_compute/device_map.h"
#include "server/solver/gl_compute/device_model.h"
#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/gl_device.h"
#include "server/solver/gl_compute/planned_cloth.h"
#include "server/solver/gl_compute/pull_lists.h"
#include "server/solver/self_contact/contact_surface.h"

namespace drape {

// For a model and parameters.
struct ClothRoom {
  GlScheme scheme;
  std::shared_ptr<const DeviceModel> model{};
  std::vector<std::shared_ptr<const DeviceMap>> maps{};
  WordRange parameter_words{};
  shader::ParameterLayout parameter_layout{};
  WordRange contact_words{};
  uint32_t pair_capacity = 0;
};

// The kernels with which a cloth tells its impulses, by its present scheme.
KernelVariant VariantThatTells(const GlCloth& cloth);

// Every call with the context current. What is refused (RESOURCE_EXHAUSTED) has changed nothing.
class RoomMaker {
 public:
  // The device must outlive it.
  explicit RoomMaker(GlDevice* device)
      : device_(*device),
        models_(&device_.arrays->models),
        maps_(&device_.arrays->models),
        pull_lists_(&device_.arrays->models) {}

  // `cloth_count`: of the backend, without this one.
  Result<ClothRoom> Make(const std::shared_ptr<const SceneModel>& model,
                         const ClothParameters& parameters, LengthSource lengths,
                         size_t cloth_count);
  // `pair_capacity`: of a cloth that touches itself.
  Result<GlScheme> MakeScheme(const PlannedCloth& cloth, const DeviceModel& model,
                              uint32_t pair_capacity);
  // More room for the pairs of a cloth whose step needed it. Where there is none, its particles
  // move alike in substeps with too many.
  void TakeMorePairs(GlCloth& cloth);
  // Room for the impulses of a cloth that is asked for them, by its present scheme; kernels like
  // its own. RESOURCE_EXHAUSTED, or what the device says of the kernels.
  Status MakeImpulses(GlCloth& cloth);

 private:
  Status TakeScratch(const PlannedCloth& cloth, GlScheme& scheme);
  Status TakeParameterWords(const PlannedCloth& cloth, size_t cloth_count, ClothRoom& room);

  GlDevice& device_;
  ModelStore models_;
  MapStore maps_;
  PullListStore pull_lists_;
  ContactSurfaceCache surfaces_;
};

}  // namespace drape
