// How strips that groups of lanes solve are spread over lanes (shaders/stages/reduce_strips.glsl,
// reduce_quads.glsl).
#pragma once

#include <cstdint>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// Each lane has a particle of a strip, or four neighbouring ones. A group of DRAPE_STRIP_LANES
// lanes has whole strips.
struct StripLanes {
  std::vector<uint32_t> phase_lanes;  // [phase_count + 1] first lane of each phase, of a new group
  std::vector<uint32_t> words;  // [][DRAPE_STRIP_LANE_WORDS] the words `strip_lanes` of a model
};

// Whether lanes of the model have four particles each. The kernel must know.
bool HasLaneQuads(const SceneModel& model);

// Whether a group of lanes holds any strip.
bool FitsInLanes(const SceneModel& model);

// Pure. Needs FitsInLanes and particles below 1024.
StripLanes FindStripLanes(const SceneModel& model);

// [phase_count] lanes of each phase, whole groups. Needs FitsInLanes.
std::vector<uint32_t> CountStripLanes(const SceneModel& model);

}  // namespace drape
