#include "server/solver/cpu_reference/reference_elastic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/hinge_stages.h"
#include "server/solver/solver_constants.h"

namespace drape {

using Eigen::Vector3d;

namespace {

// The sum of weights[k] x[particles[k]], from differences, as the weights add up to 0.
Vector3d WeightedSum(const ElasticElement& element, const std::vector<Vector3d>& x) {
  Vector3d sum = Vector3d::Zero();
  for (size_t k = 1; k < 4; ++k) {
    sum += element.weights[k] * (x[element.particles[k]] - x[element.particles[0]]);
  }
  return sum;
}

// Impulse along L of an oscillator of mass m and frequency omega that the substep of length h
// follows as far as it can: all of its force and none of its damping where h omega is small.
double ElasticImpulse(double mass, double frequency_sq, double damping_share, double deflection,
                      double speed, double duration, double h, double max_frequency_sq) {
  const double ratio = std::min(h * h * frequency_sq, kMaxElasticRatio);
  const double damping = damping_share * ratio * ratio / (1 + ratio * ratio) / h;
  return -mass * duration *
         (std::min(frequency_sq, max_frequency_sq) * deflection + damping * speed);
}

using Impulses = std::array<Vector3d, 4>;  // on the particles of an element [N s]

// Of an element that acts along L.
Impulses ImpulsesAlong(const ElasticElement& element, double mass, double frequency_sq,
                       const ParticleState& state, double duration, double h,
                       double max_frequency_sq) {
  Impulses impulses = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d l = WeightedSum(element, state.positions_m);
  const double length = l.norm();
  if (length < kMinDirectionLength_m) return impulses;
  const Vector3d direction = l / length;
  const double speed = WeightedSum(element, state.velocities_m_per_s).dot(direction);
  const Vector3d impulse = direction * ElasticImpulse(mass, frequency_sq, element.damping_share,
                                                      length - element.rest_length_m, speed,
                                                      duration, h, max_frequency_sq);
  for (size_t k = 0; k < 4; ++k) impulses[k] = element.weights[k] * impulse;
  return impulses;
}

// Minus the derivatives of stiffness / 2 |L - l0 n|^2, n the normal (equations 15a, 16a).
Impulses HingeImpulses(const ElasticElement& element, double stiffness,
                       const std::vector<Vector3d>& x, double duration) {
  const auto side = [&](size_t place) -> Vector3d {
    return x[element.particles[place]] - x[element.particles[0]];
  };
  const auto& c = element.weights;
  const Vector3d edge = side(1);
  const Vector3d across = c[2] * side(2) - c[3] * side(3);
  const Vector3d product = edge.cross(across);
  const double edge_sq = edge.squaredNorm();
  const double size_sq =
      product.squaredNorm() + 4 * kHingeBlurSq * edge_sq * edge_sq + kLeastHingeArea_m4;
  const double rest = element.rest_length_m * kHingeNormalScale / std::sqrt(size_sq);
  const Vector3d from_rest = WeightedSum(element, x) - rest * product;
  const double slope = from_rest.dot(product) / size_sq;
  const Vector3d turn = rest * (from_rest - slope * product);
  const Vector3d on_edge = across.cross(turn) - 8 * kHingeBlurSq * rest * slope * edge_sq * edge;
  const Vector3d on_sides = turn.cross(edge);
  const double gain = duration * stiffness;
  Impulses impulses;
  impulses[1] = gain * (on_edge - c[1] * from_rest);
  impulses[2] = gain * c[2] * (on_sides - from_rest);
  impulses[3] = gain * c[3] * (-on_sides - from_rest);
  impulses[0] = -(impulses[1] + impulses[2] + impulses[3]);
  return impulses;
}

// Of particles with these inverse masses.
std::vector<Vector3d> ChangesByElements(const SceneModel& model, std::span<const double> w,
                                        const ParticleState& state, double duration_s,
                                        double substep_s, double max_frequency_sq_per_s2) {
  std::vector<Vector3d> changes(model.particle_count(), Vector3d::Zero());
  const ElasticShares& shares = model.elastic_shares();
  for (uint32_t e = 0; e < model.elastic_count(); ++e) {
    const ElasticElement& element = model.elastic_elements()[e];
    const double mass = shares.masses_kg[e];
    const double frequency_sq = shares.frequencies_sq_per_s2[e];
    const Impulses impulses =
        element.acts_along()
            ? ImpulsesAlong(element, mass, frequency_sq, state, duration_s, substep_s,
                            max_frequency_sq_per_s2)
            : HingeImpulses(element, mass * std::min(frequency_sq, max_frequency_sq_per_s2),
                            state.positions_m, duration_s);
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t i = element.particles[k];
      changes[i] += w[i] * impulses[k];
    }
  }
  return changes;
}

}  // namespace

std::vector<Vector3d> ElasticVelocityChanges(const SceneModel& model, const ParticleState& state,
                                             double duration_s, double substep_s,
                                             double max_frequency_sq_per_s2) {
  return ChangesByElements(model, model.inverse_masses_per_kg(), state, duration_s, substep_s,
                           max_frequency_sq_per_s2);
}

std::vector<Vector3d> ElasticImpulses(const SceneModel& model, const ParticleState& state,
                                      double duration_s, double substep_s,
                                      double max_frequency_sq_per_s2) {
  const std::vector<double> ones(model.particle_count(), 1.0);
  return ChangesByElements(model, ones, state, duration_s, substep_s, max_frequency_sq_per_s2);
}

}  // namespace drape

namespace drape::reference {
namespace {

// The impulses of the elements on the particles, if anybody asks for those on what is held.
std::optional<std::vector<Vector3d>> AskedImpulses(const StepContext& context,
                                                   const ParticleState& state, double duration_s) {
  if (context.impulses == nullptr) return std::nullopt;
  return ElasticImpulses(context.model, state, duration_s, context.parameters.settings.substep_s(),
                         context.plan.max_elastic_frequency_sq_per_s2);
}

}  // namespace

void ApplyElastic(const StepContext& context, double duration_s,
                  const std::vector<Eigen::Vector3d>& positions,
                  std::vector<Eigen::Vector3d>& velocities) {
  if (!context.plan.Has(StepStage::kApplyElastic)) return;
  const ParticleState state{positions, velocities};
  if (const auto impulses = AskedImpulses(context, state, duration_s)) context.PullHeld(*impulses);
  const auto changes = ElasticVelocityChanges(context.model, state, duration_s,
                                              context.parameters.settings.substep_s(),
                                              context.plan.max_elastic_frequency_sq_per_s2);
  context.Add(changes, 1, velocities);
}

// As long as forces act on u in this substep; found for all substeps that share them.
void ShareHinges(StepContext& context) {
  const Substep& substep = context.substep;
  if (substep.finds_hinges) {
    ParticleState predicted{context.base, context.u};
    for (uint32_t i = 0; i < context.model.particle_count(); ++i) {
      predicted.positions_m[i] += (context.h + substep.hinge_lead_s) * context.u[i];
    }
    context.hinge_a =
        ElasticVelocityChanges(context.model, predicted, 1, context.parameters.settings.substep_s(),
                               context.plan.max_elastic_frequency_sq_per_s2);
    if (auto forces = AskedImpulses(context, predicted, 1)) {
      context.hinge_forces = *std::move(forces);
    }
  }
  if (context.impulses != nullptr) context.PullHeld(context.hinge_forces, substep.force_s());
  context.Add(context.hinge_a, substep.force_s(), context.u);
}

// Stage by stage, each from where the particles will be at the velocities so far.
void SolveHinges(StepContext& context) {
  if (!context.plan.Has(StepStage::kSolveHinges)) return;
  if (context.plan.solver.hinge_period > 1) return ShareHinges(context);
  const uint32_t particle_count = context.model.particle_count();
  std::vector<Vector3d> change(particle_count, Vector3d::Zero());
  std::vector<Vector3d> pull(particle_count, Vector3d::Zero());
  ParticleState predicted;
  for (const auto& [momentum, gain] : HingeStages(context.plan.solver.hinge_stages)) {
    predicted.positions_m = context.base;
    for (uint32_t i = 0; i < particle_count; ++i) {
      predicted.positions_m[i] += context.h * context.u[i];
    }
    predicted.velocities_m_per_s = context.u;
    const auto kick = ElasticVelocityChanges(context.model, predicted, context.substep.force_s(),
                                             context.parameters.settings.substep_s(),
                                             context.plan.max_elastic_frequency_sq_per_s2);
    for (uint32_t i = 0; i < particle_count; ++i) {
      change[i] = momentum * change[i] + gain * kick[i];
    }
    if (const auto impulses = AskedImpulses(context, predicted, context.substep.force_s())) {
      for (uint32_t i = 0; i < particle_count; ++i) {
        pull[i] = momentum * pull[i] + gain * (*impulses)[i];
      }
      context.PullHeld(pull);
    }
    context.Add(change, 1, context.u);
  }
}

}  // namespace drape::reference
