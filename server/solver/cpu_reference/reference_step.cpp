#include "server/solver/cpu_reference/reference_step.h"

#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_colliders.h"
#include "server/solver/cpu_reference/reference_constraints.h"
#include "server/solver/cpu_reference/reference_contact.h"
#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_elastic.h"
#include "server/solver/cpu_reference/reference_measure.h"
#include "server/solver/cpu_reference/reference_refine.h"
#include "server/solver/cpu_reference/reference_springs.h"
#include "server/solver/cpu_reference/reference_strips.h"
#include "server/solver/cpu_reference/reference_twist.h"
#include "server/solver/cpu_reference/reference_wind.h"
#include "server/solver/solver_constants.h"
#include "server/solver/step_plan.h"

namespace drape {

namespace {

using Eigen::Vector3d;

// One step under way. Names as in server/solver/method.md: h the interval of a substep's impulses
// [s], b where they start from [m], p positions [m], v velocities [m/s], u mean velocities over the
// interval [m/s], a accelerations [m/s^2], w inverse masses [1/kg], lambda accumulated impulses of
// constraints [N s], beta those of contacts times w [m/s].
class ReferenceStep {
 public:
  ReferenceStep(const ReferenceCloth& cloth, const StepPlan& plan, uint32_t max_iterations)
      : cloth_(cloth),
        model_(*cloth.model),
        parameters_(cloth.parameters),
        pin_targets_(cloth.pin_targets_m),
        plan_(plan),
        tolerance_(plan.tolerance),
        max_iterations_(max_iterations),
        solver_(plan.solver),
        w_(model_.inverse_masses_per_kg()),
        colliders_(parameters_),
        rest_lengths_(model_, cloth.rest_lengths_m, cloth.rest_length_targets_m),
        state_(cloth.state),
        previous_(cloth.state),
        base_(model_.particle_count()),
        u_(model_.particle_count()),
        a_(model_.particle_count()) {}

  // The whole step but for commit and measure.
  void Run(StepReport& report) {
    const uint32_t substeps = parameters_.settings.substeps;
    for (uint32_t index = 0; index < plan_.schedule.size(); ++index) {
      const Substep substep = plan_.schedule[index];
      h_ = substep.interval_s;
      // Colliders are met by substeps of equal length only.
      colliders_.Place(index * h_, (index + 1) * h_);
      const ParticleState before = state_;
      Kick(substep.kick_before_s, state_.positions_m, state_.velocities_m_per_s);
      Predict(substep);
      if (substep.sets_previous) previous_ = before;
      rest_lengths_.Advance(substeps - substep.pin_shares, substeps);
      if (substep.twist_share > 0) DampTwist(model_, substep.twist_share, u_);
      if (plan_.Has(StepStage::kTether)) Tether();
      Solve(substep, report);
      residual_ = Residual();
      Integrate(substep);
      SolveVelocity();
      CorrectVelocity(substep);
      Kick(substep.kick_after_s, state_.positions_m, state_.velocities_m_per_s);
    }
    for (uint32_t k = 0; k < model_.pin_count(); ++k) {
      state_.positions_m[model_.pins()[k]] = pin_targets_[k];
    }
  }

  const ParticleState& state() const { return state_; }
  double residual() const { return residual_; }

 private:
  // What acts between the substeps, all from the same positions and velocities: springs (velocity
  // Verlet), then bending and shear, then drag and lift of the air.
  void Kick(double kick_s, const std::vector<Vector3d>& positions,
            std::vector<Vector3d>& velocities) const {
    if (kick_s == 0) return;
    if (plan_.Has(StepStage::kApplySprings)) {
      const auto accelerations = SpringAccelerations(model_, {positions, velocities});
      for (uint32_t i = 0; i < model_.particle_count(); ++i) {
        velocities[i] += kick_s * accelerations[i];
      }
    }
    if (plan_.Has(StepStage::kApplyElastic)) {
      const auto changes = ElasticVelocityChanges(model_, {positions, velocities}, kick_s,
                                                  parameters_.settings.substep_s());
      for (uint32_t i = 0; i < model_.particle_count(); ++i) velocities[i] += changes[i];
    }
    if (plan_.Has(StepStage::kApplyWind)) {
      const auto changes =
          WindVelocityChanges(model_, parameters_, {positions, velocities}, kick_s);
      for (uint32_t i = 0; i < model_.particle_count(); ++i) velocities[i] += changes[i];
    }
  }

  // Where and how fast the particles would end the substep without constraints.
  void Predict(const Substep& substep) {
    FindRebounds();
    if (substep.is_two_step) {
      PredictTwoStep();
    } else {
      PredictBallistic();
    }
    for (uint32_t k = 0; k < model_.pin_count(); ++k) PredictPin(k, substep);
    if (substep.is_two_step) Kick(substep.kick_within_s, Predicted(), u_);
    lambda_.assign(model_.constraint_count(), 0.0);
    joint_lambda_.assign(model_.joint_count(), Vector3d::Zero());
    beta_.assign(model_.particle_count() * parameters_.colliders.size(), {});
  }

  // How fast a particle leaves each collider that it hits in this substep.
  void FindRebounds() {
    rebounds_.assign(model_.particle_count() * colliders_.size(), 0.0);
    if (!HasRestitution(parameters_)) return;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      const Vector3d& p = state_.positions_m[i];
      for (size_t c = 0; c < colliders_.size(); ++c) {
        const Vector3d relative = state_.velocities_m_per_s[i] - colliders_.VelocityAtStart(c, p);
        rebounds_[i * colliders_.size() + c] =
            ReboundSpeed(colliders_.AtStart(c, p), relative, parameters_.gravity_m_per_s2,
                         parameters_.restitution, SlowestRebound(parameters_));
      }
    }
  }

  // u = v + a h/2: p + h u is the ballistic position (Bender et al. 2009, section 3.1, eq. 2).
  void PredictBallistic() {
    std::fill(a_.begin(), a_.end(), parameters_.gravity_m_per_s2);
    if (solver_.has_spring_forces) {
      const std::vector<Vector3d> accelerations = SpringAccelerations(model_, state_);
      for (uint32_t i = 0; i < model_.particle_count(); ++i) a_[i] += accelerations[i];
    }
    base_ = state_.positions_m;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      u_[i] = state_.velocities_m_per_s[i] + a_[i] * (h_ / 2);
    }
  }

  // The backward differentiation formula of second order, for positions and velocities alike.
  // Damping is part of it, at the end of the substep.
  void PredictTwoStep() {
    const double damping = 1 / (1 + parameters_.damping_per_s * h_);
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      const Vector3d& p = state_.positions_m[i];
      const Vector3d& v = state_.velocities_m_per_s[i];
      base_[i] = p + (p - previous_.positions_m[i]) / 3;
      u_[i] = v + (v - previous_.velocities_m_per_s[i]) / 3 + h_ * parameters_.gravity_m_per_s2;
      u_[i] *= damping;
    }
  }

  // The pin's share of its way as a velocity; b so that it ends there.
  void PredictPin(uint32_t k, const Substep& substep) {
    const uint32_t i = model_.pins()[k];
    const Vector3d& p = state_.positions_m[i];
    const Vector3d way = (pin_targets_[k] - p) / substep.pin_shares;
    u_[i] = way / substep.duration_s;
    base_[i] = p;
    if (substep.is_two_step) base_[i] += way - h_ * u_[i];
  }

  std::vector<Vector3d> Predicted() const {
    std::vector<Vector3d> predicted = base_;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) predicted[i] += h_ * u_[i];
    return predicted;
  }

  // From particle i to j at the end of the substep, b + h u.
  Vector3d PredictedDifference(uint32_t i, uint32_t j) const {
    return (base_[j] - base_[i]) + h_ * (u_[j] - u_[i]);
  }

  // No particle ends the substep farther from a pin than the cloth between them is long (an
  // inequality in the sense of Bender et al. 2009, section 3.1); nearest pin first.
  void Tether() {
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      const uint32_t end = model_.tether_offsets()[i + 1];
      for (uint32_t t = model_.tether_offsets()[i]; t < end; ++t) {
        const auto [pin, reach] = model_.tethers()[t];
        const Vector3d d = PredictedDifference(pin, i);
        const double excess = d.norm() - reach;
        if (!(excess > 0)) continue;
        const auto [n, slope] = BlendDirections(base_[i] - base_[pin], d, solver_.end_share);
        u_[i] -= n * (excess / h_ / slope);
      }
    }
  }

  // Sweeps until none of them changes anything, at most max_iterations.
  void Solve(const Substep& substep, StepReport& report) {
    for (uint32_t sweep = 0; sweep < max_iterations_; ++sweep) {
      bool has_changed = false;
      if (plan_.Has(StepStage::kSolveStrips)) {
        has_changed |= SolveStrips({model_, base_, solver_.end_share, h_, tolerance_}, u_, lambda_);
      }
      if (substep.is_last && sweep + 1 == max_iterations_) Refine();
      if (plan_.Has(StepStage::kSolveDistance)) has_changed |= SolveDistance();
      has_changed |= SolveJoints();
      has_changed |= SolveContacts();
      ++report.iterations;
      if (tolerance_ > 0 && !has_changed) return;
    }
    if (tolerance_ > 0) report.converged = false;
  }

  // Error that the impulse has to remove: C + (alpha/h) lambda.
  double DistanceError(uint32_t index, double length) const {
    const DistanceConstraint& constraint = model_.constraints()[index];
    return length - rest_lengths_[index] + constraint.compliance_m_per_n / h_ * lambda_[index];
  }

  // The impulse of every constraint, in order of the colours (Bender et al. 2009, section 3.2; the
  // accumulated lambda makes the elongation of compliant constraints independent of the sweeps).
  bool SolveDistance() {
    bool has_changed = false;
    for (uint32_t index = 0; index < model_.constraint_count(); ++index) {
      has_changed |= SolveConstraint(index, tolerance_);
    }
    return has_changed;
  }

  // Returns whether there was anything to solve.
  bool SolveConstraint(uint32_t index, double tolerance) {
    const auto [i, j, model_length, compliance, kind] = model_.constraints()[index];
    const Vector3d d = PredictedDifference(i, j);
    const double length = d.norm();
    const double error = DistanceError(index, length);
    if (tolerance > 0 && !(std::abs(error) > tolerance * rest_lengths_[index])) return false;

    const auto [n, slope] = BlendDirections(base_[j] - base_[i], d, solver_.end_share);
    const double impulse = AdmissibleImpulse(
        kind, lambda_[index], -error / h_ / ((w_[i] + w_[j]) * slope + compliance / (h_ * h_)));
    if (kind != ConstraintKind::kEqual && impulse == 0) return false;  // slack
    lambda_[index] += impulse;
    u_[i] -= w_[i] * impulse * n;
    u_[j] += w_[j] * impulse * n;
    return true;
  }

  void Refine() {
    const StripPrediction prediction{model_, base_, solver_.end_share, h_, tolerance_};
    for (uint32_t round = 0, solves = 0; round < solver_.refine_rounds; ++round) {
      const auto links = LinksToRefine(prediction, solver_.refine_above_strain, u_);
      for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
        for (const uint32_t index : links) RefineLink(model_, index, h_, u_, base_);
      }
      solves += kRefineSweeps * static_cast<uint32_t>(links.size());
      if (links.empty() || solves >= solver_.refine_solves) return;
    }
  }

  // C + (alpha/h) lambda of a joint, with C = p_j - p_i at the end of the substep.
  Vector3d JointError(uint32_t index) const {
    const auto [i, j, compliance] = model_.joints()[index];
    return PredictedDifference(i, j) + compliance / h_ * joint_lambda_[index];
  }

  // The impulse of every joint, in order of their colours: three equality constraints along the
  // axes at once, which are independent and linear, so one impulse removes the error of one joint
  // exactly (Bender et al. 2009, section 3.2).
  bool SolveJoints() {
    bool has_changed = false;
    for (uint32_t index = 0; index < model_.joint_count(); ++index) {
      const auto [i, j, compliance] = model_.joints()[index];
      const Vector3d error = JointError(index);
      if (tolerance_ > 0 && !(error.norm() > tolerance_ * model_.length_scale_m())) continue;

      const Vector3d impulse = -error / h_ / (w_[i] + w_[j] + compliance / (h_ * h_));
      joint_lambda_[index] += impulse;
      u_[i] -= w_[i] * impulse;
      u_[j] += w_[j] * impulse;
      has_changed = true;
    }
    return has_changed;
  }

  bool SolveContacts() {
    bool has_changed = false;
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      if (w_[i] == 0) continue;
      for (size_t c = 0; c < parameters_.colliders.size(); ++c) {
        ContactImpulse& beta = beta_[i * parameters_.colliders.size() + c];
        if (SolveContact(i, c, beta)) has_changed = true;
      }
    }
    return has_changed;
  }

  ReferenceContact PredictedContact(uint32_t i, size_t c) const {
    return colliders_.AtEnd(c, base_[i] + h_ * u_[i]);
  }

  // Smallest gap that the end of the substep may have: 0, or less for what was deep inside before.
  double GapFloor(uint32_t i, size_t c) const {
    const double gap = colliders_.AtStart(c, base_[i]).gap;
    return std::min(0.0, gap + kMaxDepenetrationSpeed_m_per_s * h_);
  }

  // Whether a change of velocity of this size keeps the sweeps going. Smaller ones are applied too:
  // in short substeps friction consists of nothing else.
  bool IsAboveTolerance(double velocity_change) const {
    return tolerance_ == 0 || h_ * velocity_change > tolerance_ * model_.length_scale_m();
  }

  // gap >= floor with impulses that only push (Bender et al. 2009, section 3.2, inequality
  // constraints), then Coulomb friction against the motion of the substep relative to the surface.
  bool SolveContact(uint32_t i, size_t c, ContactImpulse& beta) {
    bool has_changed = false;
    const auto [gap, n] = PredictedContact(i, c);
    const double normal = std::max(beta.normal - (gap - GapFloor(i, c)) / h_, 0.0);
    const double normal_change = normal - beta.normal;
    u_[i] += normal_change * n;
    beta.normal = normal;
    has_changed |= IsAboveTolerance(std::abs(normal_change));

    const bool has_friction =
        parameters_.friction_static > 0 && (beta.normal > 0 || !beta.tangential.isZero(0));
    if (!has_friction) return has_changed;
    const Vector3d relative = u_[i] - colliders_.MeanVelocity(c, base_[i]);
    const Vector3d sliding = relative - relative.dot(n) * n;
    const Vector3d tangential =
        CoulombImpulse(beta.tangential - sliding, beta.normal, parameters_.friction_static,
                       parameters_.friction_dynamic);
    const Vector3d tangential_change = tangential - beta.tangential;
    u_[i] += tangential_change;
    beta.tangential = tangential;
    return has_changed || IsAboveTolerance(tangential_change.norm());
  }

  // The part of an error that an impulse may still remove: of an inequality no more than undoes the
  // impulses so far.
  double AdmissibleError(uint32_t index, double error) const {
    const auto& constraint = model_.constraints()[index];
    const double error_per_impulse =
        h_ * (w_[constraint.i] + w_[constraint.j]) + constraint.compliance_m_per_n / h_;
    if (constraint.kind == ConstraintKind::kEqual) return error;
    return error_per_impulse *
           AdmissibleImpulse(constraint.kind, lambda_[index], -error / error_per_impulse);
  }

  // Largest error left after the sweeps [m].
  double Residual() const {
    double residual = 0;
    for (uint32_t index = 0; index < model_.constraint_count(); ++index) {
      const auto& constraint = model_.constraints()[index];
      const double length = PredictedDifference(constraint.i, constraint.j).norm();
      residual = std::max(residual, std::abs(AdmissibleError(index, DistanceError(index, length))));
    }
    for (uint32_t index = 0; index < model_.joint_count(); ++index) {
      residual = std::max(residual, JointError(index).norm());
    }
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      if (w_[i] == 0) continue;
      for (size_t c = 0; c < parameters_.colliders.size(); ++c) {
        const double violation = GapFloor(i, c) - PredictedContact(i, c).gap;
        residual = std::max(residual, violation);
      }
    }
    return residual;
  }

  // p = b + h u, and v = u + a h/2 (Bender et al. 2009, section 3.1, eq. 1 and 2) or, with two
  // steps and for pins, the velocity itself.
  void Integrate(const Substep& substep) {
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      state_.positions_m[i] = base_[i] + h_ * u_[i];
      state_.velocities_m_per_s[i] = u_[i];
      if (!substep.is_two_step) state_.velocities_m_per_s[i] += a_[i] * (h_ / 2);
    }
    for (const uint32_t i : model_.pins()) state_.velocities_m_per_s[i] = u_[i];
  }

  // Velocity constraints n . (v_j - v_i) = 0 of rigid links and v_j - v_i = 0 of rigid joints,
  // after the advance (Bender et al. 2009, section 3.2; with the direction at the start: RATTLE).
  // What gives way, ropes and struts have none.
  void SolveVelocity() {
    std::vector<Vector3d>& v = state_.velocities_m_per_s;
    for (uint32_t sweep = 0; sweep < solver_.velocity_iterations; ++sweep) {
      for (const auto& [i, j, length, compliance, kind] : model_.constraints()) {
        if (compliance > 0 || kind != ConstraintKind::kEqual) continue;
        const Vector3d n = DirectionOf(state_.positions_m[j] - state_.positions_m[i]);
        const double impulse = -n.dot(v[j] - v[i]) / (w_[i] + w_[j]);
        v[i] -= w_[i] * impulse * n;
        v[j] += w_[j] * impulse * n;
      }
      for (const auto& [i, j, compliance] : model_.joints()) {
        if (compliance > 0) continue;
        const Vector3d impulse = -(v[j] - v[i]) / (w_[i] + w_[j]);
        v[i] -= w_[i] * impulse;
        v[j] += w_[j] * impulse;
      }
    }
  }

  // Velocity constraints of the contacts that pushed, after the advance, then damping.
  void CorrectVelocity(const Substep& substep) {
    if (substep.is_two_step) return;
    const double decay = std::exp(-parameters_.damping_per_s * h_);
    for (uint32_t i = 0; i < model_.particle_count(); ++i) {
      if (w_[i] == 0) continue;
      for (size_t c = 0; c < parameters_.colliders.size(); ++c) {
        const size_t contact = i * parameters_.colliders.size() + c;
        if (beta_[contact].normal > 0) {
          CorrectContactVelocity(i, c, rebounds_[contact]);
        }
      }
      if (parameters_.damping_per_s > 0) state_.velocities_m_per_s[i] *= decay;
    }
  }

  // No approach velocity is left, and what hits leaves with its rebound speed; the impulse that
  // this takes carries Coulomb friction.
  void CorrectContactVelocity(uint32_t i, size_t c, double rebound) {
    const Vector3d& p = state_.positions_m[i];
    const Vector3d n = colliders_.AtEnd(c, p).normal;
    const Vector3d of_surface = colliders_.VelocityAtEnd(c, p);
    Vector3d v = state_.velocities_m_per_s[i] - of_surface;
    const double normal_impulse = rebound - v.dot(n);
    if (!(normal_impulse > 0)) return;
    const Vector3d sliding = v - v.dot(n) * n;
    v = sliding + CoulombImpulse(-sliding, normal_impulse, parameters_.friction_static,
                                 parameters_.friction_dynamic);
    if (rebound > 0) v += rebound * n;
    state_.velocities_m_per_s[i] = colliders_.are_moving() ? Vector3d(of_surface + v) : v;
  }

  const ReferenceCloth& cloth_;
  const SceneModel& model_;
  const ClothParameters& parameters_;
  const std::vector<Vector3d>& pin_targets_;
  const StepPlan& plan_;
  const double tolerance_;
  const uint32_t max_iterations_;
  const SolverChoice& solver_;
  const std::span<const double> w_;

  double h_ = 0;
  ReferenceColliders colliders_;
  ReferenceLengths rest_lengths_;
  ParticleState state_;     // p and v
  ParticleState previous_;  // p' and v', two steps only
  std::vector<Vector3d> base_;
  std::vector<Vector3d> u_;
  std::vector<Vector3d> a_;
  std::vector<double> lambda_;          // [constraint_count]
  std::vector<Vector3d> joint_lambda_;  // [joint_count]
  std::vector<ContactImpulse> beta_;    // [particle_count][collider_count]
  std::vector<double> rebounds_;        // [particle_count][collider_count] [m/s]; 0: no hit
  double residual_ = 0;
};

}  // namespace

StepReport StepReferenceCloth(ReferenceCloth& cloth, bool measure, uint32_t max_iterations) {
  StepReport report;
  double residual = 0;
  if (cloth.fault == FaultReason::kNone) {
    const LengthSource lengths =
        cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel;
    const StepPlan plan = PlanStep(*cloth.model, cloth.parameters, lengths, ScalarType::kFloat64);
    ReferenceStep step(cloth, plan, max_iterations);
    step.Run(report);
    report.warnings = plan.known_warnings;
    report.warnings.not_converged = !report.converged;
    cloth.fault = FindFault(step.state());
    if (cloth.fault == FaultReason::kNone) {
      cloth.state = step.state();  // commit
      for (RigidMotion& motion : cloth.parameters.collider_motions) {
        motion = motion.After(cloth.parameters.settings.time_step_s);
      }
      residual = step.residual();
    }
  }
  report.fault = cloth.fault;
  if (measure) {
    report.measured =
        MeasureState(*cloth.model, cloth.parameters, cloth.state, cloth.rest_length_targets_m);
    report.measured.max_residual_m = residual;
  }
  return report;
}

}  // namespace drape
