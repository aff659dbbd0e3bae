#include "server/solver/gl_compute/impulse_read.h"

#include <map>
#include <utility>

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
      const ResultWords contacts = ContactWordsOf(*cloths[k]);
      columns.push_back({words.begin, words.count});
      columns.push_back({contacts.begin, contacts.count});
      count += words.count + contacts.count;
    }
    std::vector<float> results(count);
    reader.Begin(arrays.scratch.buffer(array), columns).Take({results});
    std::span<const float> left(results);
    for (size_t n = 0; n < places.size(); ++n) {
      const GlCloth& cloth = *cloths[places[n]];
      const auto take = [&](const StateColumn& column) {
        return std::exchange(left, left.subspan(column.count)).first(column.count);
      };
      const std::span<const float> sums = take(columns[2 * n]);
      const std::span<const float> contacts = take(columns[2 * n + 1]);
      impulses[places[n]] = std::make_shared<StepImpulses>(ImpulsesFrom(cloth, sums, contacts));
    }
  }
  return impulses;
}

}  // namespace drape
