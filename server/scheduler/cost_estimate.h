// What a step will probably cost, learnt from what steps have cost.
#pragma once

#include <cstdint>
#include <span>

#include "server/solver/step_settings.h"

namespace drape {

// The work that a step has besides its solves, in solves: without it small steps would make large
// ones look expensive.
inline constexpr double kSolvesPerClothStep = 5e4;
// A step that stops its sweeps at a tolerance may suddenly need all of them. It is expected to cost
// at least this share of what it may cost, so that no step exceeds a budget by more than its
// inverse.
inline constexpr double kLeastShareOfCost = 1.0 / 20;

// What a solve costs on this device. Device thread.
class SolveRate {
 public:
  // A batch that might have made so many solves, those of kSolvesPerClothStep included.
  void Measured(double solves, double cost_us);
  double us_per_solve() const { return cost_us_ / solves_; }

 private:
  // Of recent batches; at first a guess for one core.
  double solves_ = 1e6;
  double cost_us_ = 1e3;
};

// The cost of the steps of one cloth. Device thread.
class CostEstimate {
 public:
  // Forgets the measurements: other settings, another model.
  void Forget() { measured_us_ = 0; }
  // Of the next step, which makes at most `solves`; `has_tolerance`: or fewer.
  double Expected_us(double solves, bool has_tolerance, const SolveRate& rate) const;
  // The cloth's part of what a batch cost.
  void Measured(double cost_us);
  // Its step was left undone after so much.
  void LeftUndone(double cost_us);

 private:
  double measured_us_ = 0;  // smoothed; 0: none yet
};

// A cloth in a batch.
struct ClothCost {
  CostEstimate* estimate;
  double solves;     // that its step might have made
  double thread_us;  // StepReport::thread_us
  bool is_undone;
};

// For SolveRate: of the steps of a batch that were done.
struct DoneWork {
  double solves = 0;  // that they might have made
  double cost_us = 0;
};

// Divides the cost of a batch among its cloths: by the time of the threads where the backend tells
// it, else by solves.
DoneWork ShareCost(std::span<const ClothCost> cloths, double cost_us);

}  // namespace drape
