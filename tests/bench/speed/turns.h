// Cloths that are stepped for a while at a time, so that several ways of stepping can take turns.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/solver/backend.h"
#include "tests/support/scenes.h"

namespace drape::bench {

// Equal cloths, each under its own gravity (MakeBatch), on a backend of their own.
class TurnTaker {
 public:
  TurnTaker(std::unique_ptr<Backend> backend, const test::Scene& start, uint32_t cloths);

  uint32_t cloths() const { return static_cast<uint32_t>(items_.size()); }
  uint32_t particles() const { return particles_; }  // of each cloth

  // Mean wall time of a step [ms], of at least one and of as many as take `turn_s`.
  double Turn_ms(double turn_s);

 private:
  std::unique_ptr<Backend> backend_;
  uint32_t particles_;
  std::vector<StepItem> items_;
};

}  // namespace drape::bench
