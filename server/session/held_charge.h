// What counts for a cloth beside its particles and its model.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>

#include "server/core/status.h"

namespace drape {

class ClothRecord;

// Of one cloth, as much as it has ever had of something, until it ends: what it had once it mostly
// has again, and a change that needs no more than before is not refused. Thread-safe.
class HeldCharge {
 public:
  uint32_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }
  // No effect unless it is more than before.
  void Hold(uint32_t count, std::shared_ptr<const void> charge) {
    const std::lock_guard lock(mutex_);
    if (count <= count_) return;
    count_ = count;
    charge_.swap(charge);  // the old one is freed without the lock
  }
  // It counts no longer, though the cloth may still be held.
  void Drop() {
    std::shared_ptr<const void> dropped;
    const std::lock_guard lock(mutex_);
    dropped.swap(charge_);
  }

 private:
  mutable std::mutex mutex_;
  uint32_t count_ = 0;
  std::shared_ptr<const void> charge_;
};

// What a cloth is going to have.
struct CountedCloth {
  std::shared_ptr<ClothRecord> cloth;
  uint32_t count = 0;
};

// All of them hold what they are going to have, or an error of `charge` and none more than before.
// A cloth may occur several times: the most counts. Any thread.
Status HoldAll(std::span<const CountedCloth> cloths, HeldCharge ClothRecord::*held,
               const std::function<Result<std::shared_ptr<const void>>(uint32_t count)>& charge);

}  // namespace drape
