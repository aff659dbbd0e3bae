#include "tests/stability/atlas/random_trial.h"

#include <algorithm>
#include <utility>

#include "server/solver/load.h"
#include "tests/support/states.h"

namespace drape::test {
namespace {

struct Playing {
  Scene scene;
  ClothHandle cloth;
  double start_j = 0;
};

Playing Begin(Backend& backend, Scene scene, const StepSettings& settings) {
  scene.parameters.settings = settings;
  scene.parameters.settings.sleep_motion_m = 0;
  scene.parameters = RaiseSubsteps(*scene.model, scene.parameters);
  const ClothHandle cloth = CreateCloth(backend, scene);
  const double start_j = Energy_j(scene, ReadState(backend, cloth), 0);
  return {.scene = std::move(scene), .cloth = cloth, .start_j = start_j};
}

void Judge(Backend& backend, const Playing& playing, const StepReport& report, RandomTrial& trial) {
  if (trial.fault == FaultReason::kNone) trial.fault = report.fault;
  trial.has_warned |= report.warnings.energy_gained;
  const ParticleState state = ReadState(backend, playing.cloth);
  trial.is_finite &= IsFinite(state);
  const ClothParameters& parameters = playing.scene.parameters;
  const double lag_m_per_s =
      parameters.gravity_m_per_s2.norm() * parameters.settings.substep_s() / 2;
  const double gain_j = Energy_j(playing.scene, state, lag_m_per_s) - playing.start_j;
  trial.largest_gain = std::max(trial.largest_gain, gain_j / EnergyScale_j(playing.scene));
}

}  // namespace

std::vector<RandomTrial> TryRandomCloths(Backend& backend, RandomKind kind,
                                         const StepSettings& settings, uint64_t first_seed,
                                         uint64_t count, double duration_s) {
  std::vector<Playing> playing;
  std::vector<RandomTrial> trials;
  std::vector<StepItem> items;
  for (uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
    playing.push_back(Begin(backend, RandomCloth(kind, seed), settings));
    trials.push_back({.name = playing.back().scene.name, .seed = seed});
    items.push_back(
        {.cloth = playing.back().cloth, .pin_targets_m = {}, .energy = EnergyBalance{}});
  }
  for (double time_s = 0; time_s < duration_s; time_s += settings.time_step_s) {
    const BatchReport batch = backend.Step(items);
    for (size_t k = 0; k < trials.size(); ++k) {
      Judge(backend, playing[k], batch.reports[k], trials[k]);
      items[k].energy = batch.reports[k].energy.value_or(EnergyBalance{});
    }
  }
  for (const Playing& one : playing) backend.Destroy(one.cloth);
  return trials;
}

}  // namespace drape::test
