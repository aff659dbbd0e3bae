// The words of the impulses of a step (shaders/interface/impulse_record.h). Pure.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/solver/gl_compute/free_list.h"
#include "server/solver/gl_compute/planned_cloth.h"
#include "server/solver/gl_compute/pull_lists.h"
#include "server/solver/step_impulses.h"
#include "shaders/interface/impulse_record.h"

namespace drape {

struct GlCloth;
struct StepKernels;

using ImpulseRecord = std::array<uint32_t, DRAPE_IMPULSE_RECORD_WORDS>;

// What a cloth needs besides to tell impulses.
struct ImpulseRoom {
  const StepKernels* kernels = nullptr;
  std::shared_ptr<const DevicePullLists> lists{};
  WordRange words{};       // in Parameters: the record, the weights, the pivots
  ImpulseRecord record{};  // places in Scratch, from the start of the cloth's range

  bool is_made() const { return kernels != nullptr; }
};

// Those of ImpulseRoom::words.
uint64_t CountImpulseWords(const PlannedCloth& cloth);

// Room in Scratch behind the first `size` words of a range: sets the places, from the start of the
// range. The size with it.
uint64_t LayOutImpulses(const PlannedCloth& cloth, uint64_t size, ImpulseRecord& record);

// Of a cloth with room for impulses.
std::vector<uint32_t> PackImpulses(const GlCloth& cloth);

// Where the kernels leave the results of such a cloth, in its array of Scratch.
struct ResultWords {
  uint32_t begin = 0;
  uint32_t count = 0;
};
ResultWords ImpulseResultsOf(const GlCloth& cloth);
// Work groups that clear its sums before the step.
uint32_t CountClearingGroups(const GlCloth& cloth);

// What contacts gave to each particle: only where the step tells that.
ResultWords ContactWordsOf(const GlCloth& cloth);

// From those words, after a step that held what the cloth's grips hold.
StepImpulses ImpulsesFrom(const GlCloth& cloth, std::span<const float> results,
                          std::span<const float> contacts);
// After such a step that had no room for them: NaN.
StepImpulses UnknownImpulses(const GlCloth& cloth);

}  // namespace drape
