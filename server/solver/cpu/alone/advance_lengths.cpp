#include "server/solver/cpu/alone/advance_lengths.h"

#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {

void AdvanceLengths(const StepContext& context) {
  if (context.own_lengths == nullptr) return;
  const OwnLengths& lengths = *context.own_lengths;
  std::vector<Vec4>& now = context.scratch.rest_lengths;
  now = lengths.targets;
  const float substeps_left = context.substep.pin_shares - 1;
  if (substeps_left == 0) return;
  const float substeps = static_cast<float>(context.controls.plan.schedule.size());
  const float share = (substeps - substeps_left) / substeps;
  context.ForRanges(now.size(), kGroupGrain, [&](size_t begin, size_t end) {
    for (size_t g = begin; g < end; ++g) {
      now[g] = LengthBetween(lengths.starts[g], lengths.targets[g], share);
    }
  });
}

}  // namespace drape::cpu
