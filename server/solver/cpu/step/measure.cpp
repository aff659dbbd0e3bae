#include "server/solver/cpu/step/measure.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "server/solver/cpu/step/collider_gap.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "server/solver/cpu/step/strain_histogram.h"
#include "server/solver/energy_watch.h"
#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

double Distance(const FloatState& state, uint32_t i, uint32_t j) {
  return (ToVector3d(state.positions[j]) - ToVector3d(state.positions[i])).norm();
}

// The rest length of constraint c at the end of the step [m].
double RestLengthAtEnd(const StepContext& context, size_t c) {
  if (context.own_lengths == nullptr) return context.model.source->constraints()[c].rest_length_m;
  const uint32_t place = context.model.constraint_places[c];
  return context.own_lengths->targets[place / kVec4Size][place % kVec4Size];
}

// C + (alpha/h) Lambda of joint `index`, with C from the positions of `state` [m].
Vec4 JointResidual(const StepContext& context, const FloatState& state, size_t index) {
  const FloatJoint& joint = context.model.joints[index];
  const float alpha_over_h = joint.compliance * context.controls.inverse_h;
  return (state.positions[joint.j] - state.positions[joint.i]) +
         alpha_over_h * context.scratch.joint_impulses[index];
}

// The part of the error that the kind of the constraint does not allow [m].
double Violation(ConstraintKind kind, double error) {
  if (kind == ConstraintKind::kAtMost) return std::max(error, 0.0);
  if (kind == ConstraintKind::kAtLeast) return std::min(error, 0.0);
  return error;
}

void MeasureStrain(const StepContext& context, const FloatState& state, Measurements& measured) {
  const SceneModel& source = *context.model.source;
  double sum_of_squares = 0;
  StrainHistogram histogram;
  for (uint32_t c = 0; c < source.constraint_count(); ++c) {
    const DistanceConstraint& constraint = source.constraints()[c];
    const double rest_length = RestLengthAtEnd(context, c);
    const double error =
        Violation(constraint.kind, Distance(state, constraint.i, constraint.j) - rest_length);
    const double strain = error / rest_length;
    measured.max_strain = std::max(measured.max_strain, std::fabs(strain));
    sum_of_squares += strain * strain;
    histogram.Add(strain);
    if (constraint.compliance_m_per_n > 0) {
      measured.strain_energy_j += error * error / (2 * constraint.compliance_m_per_n);
    }
  }
  if (source.constraint_count() > 0) {
    measured.rms_strain = std::sqrt(sum_of_squares / source.constraint_count());
  }
  // The histogram counts in single precision, and may round up.
  const auto percentile = [&](uint32_t percent) {
    return std::min(histogram.Percentile(percent), measured.max_strain);
  };
  measured.strain_p50 = percentile(50);
  measured.strain_p90 = percentile(90);
  measured.strain_p99 = percentile(99);
  for (const auto& [i, j, compliance] : source.joints()) {
    const double error = Distance(state, i, j);
    if (compliance > 0) measured.strain_energy_j += error * error / (2 * compliance);
  }
  for (const Spring& spring : source.springs()) {
    const double error = Distance(state, spring.i, spring.j) - spring.rest_length_m;
    measured.strain_energy_j += 0.5 * spring.stiffness_n_per_m * error * error;
  }
}

void MeasureElastic(const StepContext& context, const FloatState& state, Measurements& measured) {
  for (const ElasticElement& element : context.model.source->elastic_elements()) {
    const double deflection =
        DeflectionOf_m(element, [&](uint32_t i) { return ToVector3d(state.positions[i]); });
    measured.strain_energy_j += 0.5 * element.stiffness_n_per_m * deflection * deflection;
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

double RmsMotion(const FloatState& start, const FloatState& end, uint32_t particle_count) {
  double sum_of_squares = 0;
  for (uint32_t i = 0; i < particle_count; ++i) {
    sum_of_squares += (ToVector3d(end.positions[i]) - ToVector3d(start.positions[i])).squaredNorm();
  }
  return std::sqrt(sum_of_squares / particle_count);
}

// All colliders of a cloth where they are when its state is measured.
class PlacedColliders {
 public:
  // `time_s` after the start of the step: at its end, or 0.
  PlacedColliders(const StepContext& context, double time_s)
      : resting_(context.controls.colliders) {
    for (size_t k = 0; k < context.collider_motions.size(); ++k) {
      const bool follows_body = time_s > 0 && context.IsBody(k);
      moving_.emplace_back(resting_[k], follows_body ? context.scratch.bodies.MotionAtEnd(k)
                                                     : context.collider_motions[k].After(time_s));
    }
  }
  size_t size() const { return resting_.size(); }
  // From collider k [m].
  float GapOf(size_t k, Vec4 place) const {
    return moving_.empty() ? RestingSurface(resting_[k]).GapAtStart(place).gap
                           : moving_[k].GapAtEnd(place).gap;
  }

 private:
  std::span<const FloatCollider> resting_;
  std::vector<MovingSurface> moving_;
};

// From the start of the step to the end of its last substep [s].
double EndOf(const SubstepSchedule& schedule) {
  return schedule.size() * schedule[schedule.size() - 1].duration_s;
}

void MeasureContacts(const StepContext& context, const FloatState& state,
                     const PlacedColliders& colliders, Measurements& measured) {
  const float margin = static_cast<float>(kContactMarginRatio) * context.model.length_scale;
  for (uint32_t i = 0; i < context.model.particle_count; ++i) {
    bool is_touching = false;
    for (size_t k = 0; k < colliders.size(); ++k) {
      const float gap = colliders.GapOf(k, state.positions[i]);
      is_touching |= gap <= margin;
      measured.max_penetration_m = std::max(measured.max_penetration_m, -double{gap});
    }
    if (is_touching) ++measured.contacts;
  }
}

// The part of an error that an impulse may still remove [m]: of an inequality no more than undoes
// the impulses so far.
double AdmissibleError(const StepContext& context, const DistanceConstraint& constraint,
                       double lambda, double error) {
  if (constraint.kind == ConstraintKind::kEqual) return error;
  const std::span<const float> w = context.held.inverse_masses;
  const double error_per_impulse =
      context.controls.h * (double{w[constraint.i]} + double{w[constraint.j]}) +
      constraint.compliance_m_per_n * context.controls.inverse_h;
  const double undone = error_per_impulse * lambda;
  return constraint.kind == ConstraintKind::kAtMost ? std::max(error, undone)
                                                    : std::min(error, undone);
}

// |C + (alpha/h) Lambda| of the constraints and how far contacts are below their floor; what is out
// of reach is above it.
double MaxResidual(const StepContext& context, const FloatState& state,
                   const PlacedColliders& colliders) {
  const FloatModel& model = context.model;
  const StepScratch& scratch = context.scratch;
  double largest = 0;
  for (size_t c = 0; c < model.constraint_places.size(); ++c) {
    const DistanceConstraint& constraint = model.source->constraints()[c];
    if (context.held.AreHeld(constraint.i, constraint.j)) continue;
    double residual = Distance(state, constraint.i, constraint.j) - RestLengthAtEnd(context, c);
    if (model.has_compliance() || model.has_inequalities()) {
      const uint32_t place = model.constraint_places[c];
      const double impulse = scratch.distance_impulses[place / kVec4Size][place % kVec4Size];
      residual += constraint.compliance_m_per_n * context.substep.inverse_interval * impulse;
      residual = AdmissibleError(context, constraint, impulse, residual);
    }
    largest = std::max(largest, std::fabs(residual));
  }
  for (size_t k = 0; k < model.joints.size(); ++k) {
    if (context.held.AreHeld(model.joints[k].i, model.joints[k].j)) continue;
    largest = std::max(largest, double{Length(JointResidual(context, state, k))});
  }
  const std::vector<uint32_t>& near = scratch.reach.near;
  for (const uint32_t i : context.held.free_particles) {
    for (size_t k = 0; k < near.size(); ++k) {
      const float floor = scratch.contacts[i * near.size() + k].floor;
      const float gap = colliders.GapOf(near[k], state.positions[i]);
      largest = std::max(largest, double{floor} - double{gap});
    }
  }
  return largest;
}

}  // namespace

Measurements Measure(const StepContext& context, const FloatState& state, FaultReason fault) {
  Measurements measured;
  MeasureStrain(context, state, measured);
  MeasureElastic(context, state, measured);
  MeasureParticles(context, state, measured);
  const bool is_good = fault == FaultReason::kNone;
  const PlacedColliders colliders(context, is_good ? EndOf(context.controls.plan.schedule) : 0);
  MeasureContacts(context, state, colliders, measured);
  if (is_good) {
    measured.max_residual_m = MaxResidual(context, state, colliders);
    measured.rms_motion_m = RmsMotion(context.scratch.state, state, context.model.particle_count);
  }
  return measured;
}

std::vector<self_contact::SelfContactMeasures> MeasureSelfContacts(
    std::span<const MeasuredCloth> cloths) {
  const ContactSurface* const surface = cloths[0].context.contact_surface;
  if (surface == nullptr) return {};
  std::vector<self_contact::Vector3d> positions;
  std::vector<double> thicknesses_m;
  for (const MeasuredCloth& cloth : cloths) {
    const Eigen::Vector3d origin = ToVector3d(cloth.context.world_origin);
    for (uint32_t i = 0; i < cloth.context.model.particle_count; ++i) {
      positions.push_back(self_contact::ToVector<self_contact::Vector3d>(
          ToVector3d(cloth.state.positions[i]) + origin));
    }
    thicknesses_m.push_back(cloth.context.controls.contact.thickness_m);
  }
  return self_contact::MeasureSelfContacts(*surface,
                                           {std::ranges::max(thicknesses_m), thicknesses_m},
                                           positions, cloths[0].context.interruption);
}

}  // namespace drape::cpu
