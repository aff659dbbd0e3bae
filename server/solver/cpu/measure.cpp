#include "server/solver/cpu/measure.h"

#include <algorithm>
#include <cmath>

#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

double Distance(const FloatState& state, uint32_t i, uint32_t j) {
  return (ToVector3d(state.positions[j]) - ToVector3d(state.positions[i])).norm();
}

void MeasureStrain(const SceneModel& source, const FloatState& state, Measurements& measured) {
  double sum_of_squares = 0;
  for (const DistanceConstraint& constraint : source.constraints()) {
    const double error = Distance(state, constraint.i, constraint.j) - constraint.rest_length_m;
    const double strain = error / constraint.rest_length_m;
    measured.max_strain = std::max(measured.max_strain, std::fabs(strain));
    sum_of_squares += strain * strain;
    if (constraint.compliance_m_per_n > 0) {
      measured.strain_energy_j += error * error / (2 * constraint.compliance_m_per_n);
    }
  }
  if (source.constraint_count() > 0) {
    measured.rms_strain = std::sqrt(sum_of_squares / source.constraint_count());
  }
  for (const Spring& spring : source.springs()) {
    const double error = Distance(state, spring.i, spring.j) - spring.rest_length_m;
    measured.strain_energy_j += 0.5 * spring.stiffness_n_per_m * error * error;
  }
}

void MeasureParticles(const StepContext& context, const FloatState& state, Measurements& measured) {
  const SceneModel& source = *context.model.source;
  const Eigen::Vector3d gravity = ToVector3d(context.controls.gravity);
  measured.lowest_m = ToVector3d(state.positions[0]).y();
  for (uint32_t i = 0; i < source.particle_count(); ++i) {
    const double mass = source.masses_kg()[i];
    const Eigen::Vector3d p = ToVector3d(state.positions[i]);
    measured.kinetic_energy_j += 0.5 * mass * ToVector3d(state.velocities[i]).squaredNorm();
    measured.potential_energy_j -= mass * gravity.dot(p);
    measured.lowest_m = std::min(measured.lowest_m, p.y());
  }
}

void MeasureContacts(const StepContext& context, const FloatState& state, Measurements& measured) {
  const float margin = static_cast<float>(kContactMarginRatio) * context.model.length_scale;
  for (uint32_t i = 0; i < context.model.particle_count; ++i) {
    bool is_touching = false;
    for (const FloatCollider& collider : context.controls.colliders) {
      const float gap = collider.GapAt(state.positions[i]).gap;
      is_touching |= gap <= margin;
      measured.max_penetration_m = std::max(measured.max_penetration_m, -double{gap});
    }
    if (is_touching) ++measured.contacts;
  }
}

// |C + (alpha/h) Lambda| of the constraints and how far contacts are below their floor.
double MaxResidual(const StepContext& context, const FloatState& state) {
  const FloatModel& model = context.model;
  const StepScratch& scratch = context.scratch;
  double largest = 0;
  for (size_t c = 0; c < model.constraint_places.size(); ++c) {
    const DistanceConstraint& constraint = model.source->constraints()[c];
    double residual = Distance(state, constraint.i, constraint.j) - constraint.rest_length_m;
    if (model.has_compliance()) {
      const uint32_t place = model.constraint_places[c];
      const double impulse = scratch.distance_impulses[place / kLaneCount][place % kLaneCount];
      residual += constraint.compliance_m_per_n * context.substep.inverse_interval * impulse;
    }
    largest = std::max(largest, std::fabs(residual));
  }
  const auto& colliders = context.controls.colliders;
  for (const uint32_t i : model.free_particles) {
    for (size_t k = 0; k < colliders.size(); ++k) {
      const float floor = scratch.contacts[i * colliders.size() + k].floor;
      const float gap = colliders[k].GapAt(state.positions[i]).gap;
      largest = std::max(largest, double{floor} - double{gap});
    }
  }
  return largest;
}

}  // namespace

Measurements Measure(const StepContext& context, const FloatState& state, FaultReason fault) {
  Measurements measured;
  MeasureStrain(*context.model.source, state, measured);
  MeasureParticles(context, state, measured);
  MeasureContacts(context, state, measured);
  if (fault == FaultReason::kNone) measured.max_residual_m = MaxResidual(context, state);
  return measured;
}

}  // namespace drape::cpu
