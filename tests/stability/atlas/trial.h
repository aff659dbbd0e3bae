// One case of the atlas, stepped and judged.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/stability/atlas/atlas.h"

namespace drape::test {

enum class Verdict {
  kSurvives,  // strain and energy within the limits at every step
  kRecovers,  // not at every step, but at every one of the last quarter
  kWarns,     // neither, and the reports warn
  kBreaks,    // neither, and the reports do not warn
  kFaults,    // FAULTED: stopped at its last good state
};
std::string_view VerdictName(Verdict verdict);  // "survives", ...

// A cloth stretched by a tenth looks stretched [-].
inline constexpr double kMaxStrain = 0.1;
// Energy above that of the start, in m g l: enough to lift the cloth by a tenth of its length [-].
// Under less than 1 g its unit is m l times 1 g.
inline constexpr double kMaxGain = 0.1;

struct TrialLimits {
  double duration_s = 1.5;    // of simulated time
  uint32_t max_steps = 1000;  // unless that is less than least_s
  double least_s = 0.5;
  uint32_t steps = 0;  // exactly this many, overriding the rest; 0: no
  double wall_s = 60;  // no step begins after that long
};

struct TrialResult {
  Verdict verdict = Verdict::kSurvives;
  // Empty, or which promise was broken: a number that is not finite was read, the neighbour's bits
  // changed, the cloth does otherwise in a batch than alone.
  std::string violation;
  uint32_t steps = 0;     // played
  bool is_cut = false;    // fewer than planned: TrialLimits::wall_s
  double max_strain = 0;  // above AtlasCase::least_strain, at any step
  double end_strain = 0;  // in the last quarter
  double max_gain = 0;    // of energy, in m g l, above AtlasCase::allowed_gain_j
  double end_gain = 0;    // in the last quarter
  std::string warnings;   // of any step: names of StepWarnings, blanks between
  double wall_s = 0;
};

// A neighbour in the batch of every case of a method, and its results alone.
class Neighbour {
 public:
  // A stirred sheet with the settings, so that it shares kernels and dispatches with the case. The
  // backend must outlive it.
  Neighbour(Backend& backend, const StepSettings& settings);
  ~Neighbour();
  Neighbour(const Neighbour&) = delete;
  Neighbour& operator=(const Neighbour&) = delete;

  // A new one at its start, to be destroyed by the caller.
  ClothHandle Create() const;
  // Hash of its bits after these steps alone.
  size_t HashAlone(uint32_t steps);

 private:
  Backend& backend_;
  Scene scene_;
  ClothHandle alone_;
  std::vector<size_t> hashes_;  // [steps stepped so far + 1]
};

// Steps the case beside the neighbour, reads every state, judges; then steps its begin once more
// alone. `settings`: the method's, at the case's time step.
TrialResult RunTrial(Backend& backend, Neighbour& neighbour, const AtlasCase& atlas_case,
                     const StepSettings& settings, const TrialLimits& limits);

}  // namespace drape::test
