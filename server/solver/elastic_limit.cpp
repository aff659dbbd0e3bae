#include "server/solver/elastic_limit.h"

#include <algorithm>
#include <cmath>

#include "server/solver/load.h"
#include "server/solver/step_plan.h"

namespace drape {
namespace {

// Of a heavy cloth, with the substeps that its load asks for.
StepPlan PlanOf(const SceneModel& model, const ClothParameters& parameters) {
  return PlanStep(model, RaiseSubsteps(model, parameters), LengthSource::kModel,
                  ScalarType::kFloat32);
}

// The limit grows with the square of the substeps; but they may decide the scheme that has it, so
// some more are tried.
std::optional<uint32_t> EnoughSubsteps(const SceneModel& model, const ClothParameters& parameters,
                                       double least_share) {
  ClothParameters finer = parameters;
  double wanted = RaiseSubsteps(model, parameters).settings.substeps / std::sqrt(least_share);
  constexpr int kTries = 8;
  constexpr double kMore = 1.02;
  for (int k = 0; k < kTries && wanted <= kMaxSubsteps; ++k, wanted *= kMore) {
    finer.settings.substeps = static_cast<uint32_t>(std::ceil(wanted));
    if (!PlanOf(model, finer).known_warnings.elastic_beyond_limit) return finer.settings.substeps;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ElasticLimit> ElasticLimitOf(const SceneModel& model,
                                           const ClothParameters& parameters) {
  if (model.elastic_count() == 0) return std::nullopt;
  const StepPlan plan = PlanOf(model, parameters);
  if (!plan.known_warnings.elastic_beyond_limit) return std::nullopt;
  ElasticLimit limit;
  for (const double frequency_sq : model.elastic_shares().frequencies_sq_per_s2) {
    if (!(frequency_sq > plan.max_elastic_frequency_sq_per_s2)) continue;
    ++limit.elements;
    limit.least_share =
        std::min(limit.least_share, plan.max_elastic_frequency_sq_per_s2 / frequency_sq);
  }
  limit.enough_substeps = EnoughSubsteps(model, parameters, limit.least_share);
  return limit;
}

}  // namespace drape
