#include "server/solver/force_limits.h"

#include <algorithm>
#include <cmath>

namespace drape {
namespace {

// Squares of the largest h omega that are stable [-].
constexpr double kVerletLimit = 4;
constexpr double kTwoStepLimit = 2.618;  // 1.618^2

}  // namespace

double ElasticRatio(const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  return h * h * model.elastic_frequency_sq_bound();
}

bool AreSpringsBeyondLimit(const SceneModel& model, const ClothParameters& parameters,
                           bool has_two_steps) {
  if (model.spring_count() == 0) return false;
  const double h = parameters.settings.substep_s();
  const double ratio = h * h * model.spring_frequency_sq_bound();
  const double limit = has_two_steps ? kTwoStepLimit : kVerletLimit;
  return ratio + std::min(ElasticRatio(model, parameters), 1.0) >= limit;
}

double SpringGain_per_s(const SceneModel& model, const ClothParameters& parameters) {
  if (model.spring_count() == 0 ||
      parameters.settings.spring_integration != SpringIntegration::kInForce) {
    return 0;
  }
  const double h = parameters.settings.substep_s();
  const double growth =
      model.spring_frequency_sq_bound() * h * (h / 2 - model.least_spring_damping_s());
  return std::log1p(std::max(growth, 0.0)) / h - parameters.damping_per_s;
}

}  // namespace drape
