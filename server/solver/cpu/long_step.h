// A step that is done in pieces, with working memory of its own.
#pragma once

#include <tbb/task_arena.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "server/solver/backend.h"
#include "server/solver/cpu/alone/cloth_step.h"
#include "server/solver/cpu/step/step_team.h"
#include "server/solver/pausable_work.h"

namespace drape::cpu {

struct Cloth;

// Of one cloth, or of all of a world in its order. Nobody changes them while it is there.
class LongStep {
 public:
  // What the step works on, with the interruption of its stages. `items`: of the piece under way,
  // which may be another one after an interruption.
  using MakeStepped = std::function<std::vector<SteppedCloth>(
      std::span<Cloth* const> cloths, const std::span<const StepItem>& items, StepTeam& team,
      std::span<StepScratch* const> scratches, Interruption* interruption)>;

  LongStep(std::vector<Cloth*> cloths, int thread_count, MakeStepped make_stepped);

  const std::vector<Cloth*>& cloths() const { return cloths_; }
  // Begins or goes on until `pause` is due, as ContinueStep does, but stops within stages too.
  // `items`: the same ones in each call. Whether it is over.
  bool Continue(std::span<const StepItem> items, tbb::task_arena& arena, const Pause& pause);
  // Once it is over, of each cloth.
  std::vector<StepReport> reports() const;
  const StepScratch& scratch(size_t k) const { return scratches_[k]; }

 private:
  bool ContinueStages(const Pause& pause, Interruption* interruption);

  const std::vector<Cloth*> cloths_;
  const int thread_count_;
  const MakeStepped make_stepped_;
  std::vector<StepScratch> scratches_;
  StepProgress progress_;
  std::span<const StepItem> items_;  // of the piece under way
  std::unique_ptr<StepTeam> team_;   // the same, and of the stage in which it has stopped
  bool is_within_stage_ = false;     // where it has stopped
  // Null: there was no thread for it. Last, so that it ends first.
  std::unique_ptr<PausableWork> work_;
};

// Backend::LongStepBytes.
uint64_t LongStepBytes(std::span<Cloth* const> cloths);

}  // namespace drape::cpu
