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

// Each of `rows`, which have `cloths`, a TurnTaker, and `ms`, takes a turn in each round; its mean
// time of a step [ms] goes to the latter, but for a first round, which warms up.
template <class Row>
void TakeTurns(std::vector<Row>& rows, uint32_t rounds, double turn_s) {
  for (uint32_t round = 0; round <= rounds; ++round) {
    for (Row& row : rows) {
      const double ms = row.cloths.Turn_ms(turn_s);
      if (round > 0) row.ms.push_back(ms);
    }
  }
}

}  // namespace drape::bench
