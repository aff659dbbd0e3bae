#include "server/solver/load.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "server/scene/body_mass.h"
#include "server/solver/solver_constants.h"

namespace drape {

namespace {

// That the cloth may have to carry.
double BodyMass_kg(std::span<const Collider> colliders) {
  double mass_kg = 0;
  for (const Collider& collider : colliders) {
    const bool is_known = collider.kind() != ShapeKind::kDistanceMap || MapOf(collider) != nullptr;
    if (collider.is_body() && is_known) mass_kg += MassOf(collider).mass_kg;
  }
  return mass_kg;
}

double GammaOf(double mass_kg, const SceneModel& model, const ClothParameters& parameters) {
  const double h = parameters.settings.substep_s();
  const double weight_n = mass_kg * parameters.gravity_m_per_s2.norm();
  return h * h * weight_n * model.link_mobility();
}

}  // namespace

double WeightGamma(const SceneModel& model, const ClothParameters& parameters) {
  const double mass_kg = model.total_mass_kg() + kBodyImpact * BodyMass_kg(parameters.colliders);
  return GammaOf(mass_kg, model, parameters);
}

double LoadRatio(const SceneModel& model, const ClothParameters& parameters) {
  // A cloth without pins may hang by one grip.
  const uint32_t holds = model.pin_count() == 0 && parameters.max_grips > 0 ? 1 : model.pin_count();
  return holds == 0 ? 0 : WeightGamma(model, parameters) / holds;
}

double OwnLoadRatio(const SceneModel& model, const ClothParameters& parameters) {
  if (model.pin_count() == 0) return 0;
  return GammaOf(model.total_mass_kg(), model, parameters) / model.pin_count();
}

ClothParameters RaiseSubsteps(const SceneModel& model, ClothParameters parameters) {
  StepSettings& settings = parameters.settings;
  if (settings.load_limit == 0) return parameters;
  const double excess = LoadRatio(model, parameters) / settings.load_limit;
  if (excess <= 1) return parameters;
  const double factor = std::min(std::sqrt(excess), kMaxLoadFactor);
  const double most = std::min<double>(kMaxSubsteps, settings.time_step_s / kMinSubstep_s);
  const double raised = std::min(std::ceil(settings.substeps * factor), std::floor(most));
  settings.substeps = std::max(settings.substeps, static_cast<uint32_t>(raised));
  return parameters;
}

}  // namespace drape
