#include "server/solver/gl_compute/scratch_pool.h"

#include <optional>

namespace drape {

Result<ScratchPool> ScratchPool::Create(int64_t max_bytes) {
  ScratchPool pool(max_bytes);
  DRAPE_RETURN_IF_ERROR(pool.AddArray());
  return pool;
}

Status ScratchPool::AddArray() {
  Result<DeviceArena> array = DeviceArena::Create("scratch", max_bytes_);
  if (!array.ok()) return array.status();
  arrays_.push_back(std::make_unique<DeviceArena>(std::move(array).value()));
  return Status::Ok();
}

Result<ScratchRange> ScratchPool::Allocate(uint64_t words) {
  for (uint32_t k = 0; k < arrays_.size(); ++k) {
    std::optional<WordRange> range = arrays_[k]->AllocateWithin(words);
    if (range) return ScratchRange(k, std::move(*range));
  }
  // All arrays but the last are as large as the device allows.
  if (!arrays_.back()->CanGrowFor(words) && arrays_.back()->IsAllowed(words)) {
    DRAPE_RETURN_IF_ERROR(AddArray());
  }
  Result<WordRange> range = arrays_.back()->Allocate(words);
  if (range.ok()) {
    return ScratchRange(static_cast<uint32_t>(arrays_.size() - 1), std::move(range).value());
  }
  return range.status();
}

}  // namespace drape
