// Reads states of cloths from the backend.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/scheduler/step_work.h"
#include "server/solver/device_backend.h"

namespace drape {

// The cloths of one receiver; all alive.
using ClothSpan = std::span<const std::shared_ptr<ClothRuntime>>;

// One BeginRead for all receivers, and the rows that each of them will get. Device thread.
class SharedRead {
 public:
  SharedRead(Backend& backend, std::span<const ClothSpan> receivers, const StateFields& fields);
  // A slice of the columns for each receiver. Once.
  std::vector<StateColumns> Take();

 private:
  std::unique_ptr<PendingRead> read_;
  std::vector<size_t> rows_;  // of each receiver
};

// Stamps and columns of the cloths, all alive. Device thread.
ClothStates ReadClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields);

// Like ReadClothStates, but with a copy on the device instead of the columns if the backend can
// make one. Whole cloths only: `fields` names no particles.
ClothStates CopyClothStates(Backend& backend, ClothSpan cloths, const StateFields& fields);

}  // namespace drape
