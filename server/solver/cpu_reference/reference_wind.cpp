#include "server/solver/cpu_reference/reference_wind.h"

#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape {

using Eigen::Vector3d;

Vector3d VelocityAfterAir(const Vector3d& r, const Vector3d& area_vector_m2, double mass_kg,
                          const ClothParameters& parameters, double duration_s) {
  const double area = area_vector_m2.norm();
  const double speed = r.norm();
  if (area == 0 || speed == 0) return r;
  Vector3d n = area_vector_m2 / area;
  if (r.dot(n) < 0) n = -n;
  const double cosine = std::min(r.dot(n) / speed, 1.0);
  const double sine_sq = 1 - cosine * cosine;

  // Force on the triangle over its mass, times the duration, over the speed.
  const double per_coefficient = duration_s * kAirDensity_kg_per_m3 * area * speed / (2 * mass_kg);
  const double drag = std::min(parameters.air_drag * per_coefficient * cosine, kMaxAirRatio);
  const double lift = std::min(parameters.air_lift * per_coefficient, kMaxAirRatio);

  // Lift turns r away from n, at most until the triangle is edge-on to the air; drag shortens it.
  const double turn = lift * cosine / (1 + lift * sine_sq);
  const Vector3d turned = r - turn * (speed * n - cosine * r);
  return turned / std::sqrt(1 + turn * turn * sine_sq) / (1 + drag);
}

namespace {

// Of particles with these inverse masses.
std::vector<Vector3d> ChangesByWind(const SceneModel& model, std::span<const double> w,
                                    const ClothParameters& parameters, const ParticleState& state,
                                    double duration_s) {
  std::vector<Vector3d> changes(model.particle_count(), Vector3d::Zero());
  const std::vector<Vector3d>& p = state.positions_m;
  const std::vector<Vector3d>& v = state.velocities_m_per_s;
  for (size_t t = 0; t < model.triangles().size(); ++t) {
    const auto& [i, j, k] = model.triangles()[t];
    const Vector3d shares(model.corner_shares()[i], model.corner_shares()[j],
                          model.corner_shares()[k]);
    const Vector3d velocity =
        (shares[0] * v[i] + shares[1] * v[j] + shares[2] * v[k]) / shares.sum();
    const Vector3d r = parameters.wind_m_per_s - velocity;
    const Vector3d area_vector = (p[j] - p[i]).cross(p[k] - p[i]) / 2;
    const double mass = model.triangle_masses_kg()[t];
    const Vector3d impulse =
        mass * (r - VelocityAfterAir(r, area_vector, mass, parameters, duration_s));
    for (const uint32_t corner : {i, j, k}) {
      changes[corner] += w[corner] * model.corner_shares()[corner] * impulse;
    }
  }
  return changes;
}

}  // namespace

std::vector<Vector3d> WindVelocityChanges(const SceneModel& model,
                                          const ClothParameters& parameters,
                                          const ParticleState& state, double duration_s) {
  return ChangesByWind(model, model.inverse_masses_per_kg(), parameters, state, duration_s);
}

std::vector<Vector3d> WindImpulses(const SceneModel& model, const ClothParameters& parameters,
                                   const ParticleState& state, double duration_s) {
  const std::vector<double> ones(model.particle_count(), 1.0);
  return ChangesByWind(model, ones, parameters, state, duration_s);
}

}  // namespace drape

namespace drape::reference {

void ApplyWind(const StepContext& context, double duration_s,
               const std::vector<Eigen::Vector3d>& positions,
               std::vector<Eigen::Vector3d>& velocities) {
  if (!context.plan.Has(StepStage::kApplyWind)) return;
  const ParticleState state{positions, velocities};
  if (context.impulses != nullptr) {
    context.PullHeld(WindImpulses(context.model, context.parameters, state, duration_s));
  }
  const auto changes = WindVelocityChanges(context.model, context.parameters, state, duration_s);
  context.Add(changes, 1, velocities);
}

}  // namespace drape::reference
