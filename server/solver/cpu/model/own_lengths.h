// Rest lengths of one cloth's own.
#pragma once

#include <span>
#include <vector>

#include "server/solver/cpu/model/float_model.h"
#include "server/solver/cpu/simd/vec4.h"

namespace drape::cpu {

// Rest lengths of one cloth, [group_count] in the places of FloatModel::groups [m].
struct OwnLengths {
  std::vector<Vec4> starts;   // before the step
  std::vector<Vec4> targets;  // at its end
};

// Lengths in the order of the source [m], packed into the places of the groups.
std::vector<Vec4> PackLengths(const FloatModel& model, std::span<const double> rest_lengths_m);

}  // namespace drape::cpu
