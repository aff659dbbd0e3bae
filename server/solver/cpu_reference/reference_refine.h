// Stage `refine` (server/solver/method.md, "refine"), in double precision.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server/solver/cpu_reference/reference_strips.h"

namespace drape {

// Links that end the substep farther from their rest length than this share of it and the
// tolerance, and all at their ends: indices of constraints in order of the colours. The rest
// lengths are the model's.
std::vector<uint32_t> LinksToRefine(const StripPrediction& prediction, double strain,
                                    const std::vector<Eigen::Vector3d>& u);

// Moves the ends of a link, b, so that at the end of the substep, at b + h u, it has its length.
void RefineLink(const SceneModel& model, uint32_t index, double interval_s,
                const std::vector<Eigen::Vector3d>& u, std::vector<Eigen::Vector3d>& base_m);

}  // namespace drape
