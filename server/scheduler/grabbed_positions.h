// Where the particles are that the grips of a step request grab.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/scheduler/cloth_runtime.h"
#include "server/scheduler/step_controls.h"
#include "server/solver/backend.h"

namespace drape {

bool Grabs(const GripControl& control);

// As they are when the request starts. Device thread.
class GrabbedPositions {
 public:
  // Reads whole cloths only where the nearest particle is searched; of the others what is grabbed,
  // of several in one read. `cloths`: those of the request.
  GrabbedPositions(Backend& backend, std::span<const ClothControl<GripControl>> controls,
                   std::span<const std::shared_ptr<ClothRuntime>> cloths);

  // What a control grabs at the place of its grip; none: nothing is near enough, or it is a pin.
  std::optional<uint32_t> GrabbedBy(const ClothControl<GripControl>& control,
                                    const ClothRuntime& cloth) const;
  // Of a particle that GrabbedBy gave for this cloth.
  Eigen::Vector3d PositionOf(uint32_t cloth_index, uint32_t particle) const;

 private:
  // Rows of one read.
  struct Rows {
    StateColumns state;
    std::vector<uint32_t> particles;  // of each cloth; empty: all
  };
  struct Place {
    const Rows* rows;
    size_t first_row;
  };

  void Read(Backend& backend, std::span<const std::shared_ptr<ClothRuntime>> cloths,
            std::span<const uint32_t> indices, std::vector<uint32_t> particles);

  std::vector<std::unique_ptr<Rows>> reads_;
  std::unordered_map<uint32_t, Place> places_;  // by cloth
};

}  // namespace drape
