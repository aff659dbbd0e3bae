// Orders in which the constraints of a model can be swept.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape::bench {

struct ConstraintOrder {
  std::vector<DistanceConstraint> constraints;
  uint32_t colours = 0;  // dependent parallel steps of one sweep; 0: not coloured
};

// The model's own: Algorithm 1 of the paper on the list as it was built.
ConstraintOrder ModelOrder(const SceneModel& model);

// The model's colours one by one in a random order; the same sets of constraints.
ConstraintOrder ShuffleColours(const SceneModel& model, std::mt19937& random);

// Algorithm 1 on the shuffled list: other colours, and maybe more.
ConstraintOrder ShuffleInput(const SceneModel& model, std::mt19937& random);

// One constraint after the other in random order, as a processor without colours could do.
ConstraintOrder ShuffleAll(const SceneModel& model, std::mt19937& random);

// One after the other, by the number of constraints between it and the nearest pin: the extreme
// case of a meaningful order. Nearest first, or last.
ConstraintOrder FromPins(const SceneModel& model);
ConstraintOrder TowardsPins(const SceneModel& model);

}  // namespace drape::bench
