#include "tests/bench/accuracy/deviations.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/core/check.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

constexpr double kNotDefined = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Deviations Deviations::NotDefined() {
  return {kNotDefined, kNotDefined, kNotDefined, kNotDefined,
          kNotDefined, kNotDefined, kNotDefined};
}

PositionError ComparePositions(const SceneModel& model, const std::vector<Vector3d>& a,
                               const std::vector<Vector3d>& b) {
  DRAPE_CHECK(a.size() == b.size(), "as many particles");
  PositionError error;
  double sum_sq = 0;
  double count = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    if (model.inverse_masses_per_kg()[i] == 0) continue;
    const double distance_sq = (a[i] - b[i]).squaredNorm();
    sum_sq += distance_sq;
    count += 1;
    error.max_m = std::max(error.max_m, std::sqrt(distance_sq));
  }
  error.rms_m = std::sqrt(sum_sq / count);
  return error;
}

double Penetration_m(const ClothParameters& parameters, const Vector3d& point_m) {
  double deepest = 0;
  for (const Collider& collider : parameters.colliders) {
    const double distance_m = SurfaceOf(collider, point_m).distance_m;
    deepest = std::max(deepest, parameters.thickness_m - distance_m);
  }
  return deepest;
}

Observer::Observer(const AccuracyScene& scene, const std::vector<Vector3d>& reference_m)
    : scene_(scene), reference_m_(reference_m) {
  const SceneModel& model = *scene.scene.model;
  double mass_kg = 0;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (model.inverse_masses_per_kg()[i] > 0) mass_kg += model.masses_kg()[i];
  }
  energy_scale_j_ = mass_kg * scene.scene.parameters.gravity_m_per_s2.norm() * scene.length_m;
  worst_.rms_position_m = worst_.max_position_m = kNotDefined;
}

void Observer::Observe(uint32_t frame, const ParticleState& state) {
  if (!test::IsFinite(state)) is_finite_ = false;
  if (!is_finite_) return;
  const uint32_t frames = scene_.frame_count();
  if (frame >= scene_.window_start_frame()) ObserveStrain(state);
  if (!scene_.scene.parameters.colliders.empty()) ObservePenetration(state);
  const double energy_j = Energy_j(state);
  if (frame == 0) start_energy_j_ = energy_j;
  const double drift = (energy_j - start_energy_j_) / energy_scale_j_;
  if (std::abs(drift) > std::abs(worst_.energy_drift)) worst_.energy_drift = drift;
  if (frame == frames && !reference_m_.empty()) {
    const PositionError error =
        ComparePositions(*scene_.scene.model, state.positions_m, reference_m_);
    worst_.rms_position_m = error.rms_m;
    worst_.max_position_m = error.max_m;
  }
}

Deviations Observer::Result() const {
  if (!is_finite_) return Deviations::NotDefined();
  Deviations result = worst_;
  result.rms_strain = std::sqrt(strain_sq_sum_ / strain_count_);
  const ClothParameters& parameters = scene_.scene.parameters;
  if (!parameters.colliders.empty() || parameters.damping_per_s > 0) {
    result.energy_drift = kNotDefined;
  }
  if (parameters.colliders.empty()) {
    result.max_penetration_m = result.midpoint_penetration_m = kNotDefined;
  }
  return result;
}

void Observer::ObserveStrain(const ParticleState& state) {
  for (const DistanceConstraint& c : scene_.scene.model->constraints()) {
    const double length_m = (state.positions_m[c.j] - state.positions_m[c.i]).norm();
    const double strain = std::abs(length_m / c.rest_length_m - 1);
    worst_.max_strain = std::max(worst_.max_strain, strain);
    strain_sq_sum_ += strain * strain;
    strain_count_ += 1;
  }
}

void Observer::ObservePenetration(const ParticleState& state) {
  const ClothParameters& parameters = scene_.scene.parameters;
  for (const Vector3d& p : state.positions_m) {
    worst_.max_penetration_m = std::max(worst_.max_penetration_m, Penetration_m(parameters, p));
  }
  for (const DistanceConstraint& c : scene_.scene.model->constraints()) {
    const Vector3d middle = (state.positions_m[c.i] + state.positions_m[c.j]) / 2;
    worst_.midpoint_penetration_m =
        std::max(worst_.midpoint_penetration_m, Penetration_m(parameters, middle));
  }
}

double Observer::Energy_j(const ParticleState& state) const {
  const SceneModel& model = *scene_.scene.model;
  const Vector3d& gravity = scene_.scene.parameters.gravity_m_per_s2;
  double energy_j = 0;
  for (uint32_t i = 0; i < model.particle_count(); ++i) {
    if (model.inverse_masses_per_kg()[i] == 0) continue;
    energy_j += model.masses_kg()[i] *
                (state.velocities_m_per_s[i].squaredNorm() / 2 - gravity.dot(state.positions_m[i]));
  }
  return energy_j;
}

}  // namespace drape::bench
