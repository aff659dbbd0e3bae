#include "server/solver/gl_compute/impulse_read.h"

#include <map>

namespace drape {

std::vector<std::shared_ptr<const StepImpulses>> ReadImpulses(
    std::span<const GlCloth* const> cloths, const DeviceArrays& arrays, StateReader& reader) {
  std::vector<std::shared_ptr<const StepImpulses>> impulses(cloths.size());
  std::map<uint32_t, std::vector<size_t>> by_array;  // of Scratch
  for (size_t k = 0; k < cloths.size(); ++k) {
    if (cloths[k]->tells_impulses) {
      by_array[cloths[k]->scratch.array()].push_back(k);
    } else {
      impulses[k] = std::make_shared<StepImpulses>(UnknownImpulses(*cloths[k]));
    }
  }
  for (const auto& [array, places] : by_array) {
    std::vector<StateColumn> columns;
    size_t count = 0;
    for (const size_t k : places) {
      const ResultWords words = ImpulseResultsOf(*cloths[k]);
      columns.push_back({words.begin, words.count});
      count += words.count;
    }
    std::vector<float> results(count);
    reader.Begin(arrays.scratch.buffer(array), columns).Take({results});
    std::span<const float> left(results);
    for (size_t n = 0; n < places.size(); ++n) {
      const GlCloth& cloth = *cloths[places[n]];
      impulses[places[n]] =
          std::make_shared<StepImpulses>(ImpulsesFrom(cloth, left.first(columns[n].count)));
      left = left.subspan(columns[n].count);
    }
  }
  return impulses;
}

}  // namespace drape
