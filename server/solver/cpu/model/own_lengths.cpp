#include "server/solver/cpu/model/own_lengths.h"

namespace drape::cpu {

std::vector<Vec4> PackLengths(const FloatModel& model, std::span<const double> rest_lengths_m) {
  std::vector<Vec4> packed(model.groups.size(), Splat(0));
  for (size_t c = 0; c < rest_lengths_m.size(); ++c) {
    const uint32_t place = model.constraint_places[c];
    packed[place / kVec4Size][place % kVec4Size] = static_cast<float>(rest_lengths_m[c]);
  }
  return packed;
}

}  // namespace drape::cpu
