// A read of many cloths in slices.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "server/scheduler/state_reading.h"

namespace drape {

// Rows that one slice reads, but at least one cloth: some ten milliseconds, so that others are
// stepped between the slices of a large read.
inline constexpr size_t kReadRowsPerSlice = size_t{1} << 19;

// Like ReadClothStates, one slice after the other. While a read of several slices lasts its cloths
// are held, so all states are of the same time; no other work of several commands may hold one of
// them meanwhile. Device thread, but for construction and destruction.
class SlicedRead {
 public:
  SlicedRead(std::vector<std::shared_ptr<ClothRuntime>> cloths, StateFields fields,
             size_t rows_per_slice = kReadRowsPerSlice);

  ClothSpan cloths() const { return cloths_; }
  // One slice more; all cloths are alive. Whether it was the last one.
  bool ReadMore(Backend& backend);
  // Once, after the last slice.
  ClothStates Take() { return std::move(states_); }
  // Lets go of the cloths of a read that is not over.
  void Release();

 private:
  size_t RowsOf(size_t cloth) const;
  void Begin();

  const std::vector<std::shared_ptr<ClothRuntime>> cloths_;
  const StateFields fields_;
  const size_t rows_per_slice_;
  size_t rows_ = 0;  // of all
  size_t next_ = 0;  // cloth
  std::vector<ClothRuntime*> held_;
  ClothStates states_;
};

}  // namespace drape
