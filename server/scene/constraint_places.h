// From the constraints of a description to those of its model.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// The index in a model of each distance constraint of its description. The model orders constraints
// by colour and leaves out those between two pins. Made in one pass over the model.
class ConstraintPlaces {
 public:
  ConstraintPlaces() = default;
  explicit ConstraintPlaces(const SceneModel& model);

  // `source`: index in the description. None if the model leaves it out, or there is none.
  std::optional<uint32_t> Find(uint32_t source) const;

 private:
  std::vector<uint32_t> places_;  // by source
};

}  // namespace drape
