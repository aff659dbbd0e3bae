// What acts of elements of bending and shear that are too stiff for the substeps of a cloth.
#pragma once

#include <cstdint>
#include <optional>

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

struct ElasticLimit {
  uint32_t elements = 0;   // that are softer than requested
  double least_share = 1;  // of the requested stiffness, that of the softest [-]
  // settings.substeps with which all are as stiff as requested; none: more than there may be.
  std::optional<uint32_t> enough_substeps{};
};

// `parameters`: as clients know them (before RaiseSubsteps). None: all are as stiff as requested.
// Otherwise the steps of the cloth have the warning elastic_beyond_limit. Pure.
std::optional<ElasticLimit> ElasticLimitOf(const SceneModel& model,
                                           const ClothParameters& parameters);

}  // namespace drape
