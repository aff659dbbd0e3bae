// The report of a step of one cloth.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "server/scene/rigid_motion.h"
#include "server/solver/step_impulses.h"

namespace drape {

// kInWorld: not the cloth itself, but another one of its world.
enum class FaultReason { kNone, kNotFinite, kRunaway, kInWorld };
// "" , "a position or velocity is not finite", ...
std::string_view FaultReasonText(FaultReason reason);

// Numerical events, counted per cloth by the caller.
struct StepWarnings {
  // The requested tolerance cannot be met in the precision of the backend and was raised.
  bool tolerance_raised = false;
  // Some substep used max_iterations without meeting the tolerance (only with a tolerance > 0).
  bool not_converged = false;
  // Explicit springs are beyond their stability limit h^2 * sum(k) * (w_i + w_j) < 4 for some
  // particle.
  bool springs_beyond_limit = false;
  // Some elastic element (bending, shear) is faster than the substep can follow, and softer than
  // requested.
  bool elastic_beyond_limit = false;
  // The step would have given the cloth kinetic and potential energy that nothing gave to it, and
  // was done again more dissipatively if it could be (energy_watch.h).
  bool energy_gained = false;
  // Springs in the force may gain energy faster than kMaxSpringGain_per_s (force_limits.h).
  bool springs_gain_energy = false;
  // One sweep per substep already takes longer than the frame budget. Set by the scheduler.
  bool over_budget = false;
  // The measured strain is beyond StepPlan::strain_limit. False unless the step is measured.
  bool strain_beyond_limit = false;
  // The step began with parts of the cloth that cross each other; they may stay crossed.
  bool starts_crossing = false;
  // In some substep more of the cloth touched than can be computed, and all its particles moved
  // alike, or none but what pins hold.
  bool contacts_given_up = false;

  friend auto operator<=>(const StepWarnings&, const StepWarnings&) = default;
};

// Measured on the committed state, only on request; zero for what the step did of a cloth that it
// did not move. Frames: the cloth's own; the caller shifts.
struct Measurements {
  double max_strain = 0;  // max |l - l0| / l0 over distance constraints
  double rms_strain = 0;
  // Of the same values: percentiles by nearest rank, rounded down to kPercentileBits.
  double strain_p50 = 0;
  double strain_p90 = 0;
  double strain_p99 = 0;
  // RMS over all particles of |end - start of the step|.
  double rms_motion_m = 0;
  double kinetic_energy_j = 0;
  // -sum m g.p with p in the cloth frame; the caller adds the frame's shift.
  double potential_energy_j = 0;
  double strain_energy_j =
      0;                  // springs, elastic elements: k/2 (l-l0)^2; compliance: C^2 / (2 alpha)
  double lowest_m = 0;    // smallest y
  uint32_t contacts = 0;  // particles with a gap <= kContactMarginRatio * length scale
  double max_penetration_m = 0;  // max(0, -gap)
  // Largest |C + (alpha/h) Lambda| of the last substep, and contact violation.
  double max_residual_m = 0;
  // Of contacts with itself, where the cloth has self-collision, and with others of its world.
  // Pairs of a vertex and a triangle or of two edges that are not farther apart than kNearPairRatio
  // thicknesses, without those of one cloth that are as near at rest.
  uint32_t near_pairs = 0;
  // Of such pairs [m]; infinite where there is none.
  double smallest_distance_m = std::numeric_limits<double>::infinity();
  // Edges that cross a triangle, exactly: of pairs without a vertex in common.
  uint32_t crossings = 0;
};

// A collider that is a rigid body, after a step: its pose and velocities in the cloth's own frame.
struct BodyState {
  uint32_t collider = 0;
  RigidMotion motion;  // the pivot is the centre of mass
};

// How the kinetic and the potential energy have changed in the steps since something else had part
// in them last, and what gains are measured by: m g l and the kinetic energy then [J].
struct EnergyBalance {
  double gain_j = 0;
  double scale_j = 0;  // 0: none of the steps has been done
};

struct StepReport {
  uint32_t iterations = 0;  // sweeps over all substeps of the step
  // Sweeps per substep that the frame budget allowed; 0: no budget. Set by the scheduler.
  uint32_t iteration_cap = 0;
  // Not computed: the cloth is at rest, and was measured when it fell asleep. Set by the scheduler.
  bool is_asleep = false;
  // Left undone by Backend::StepUntil: nothing but thread_us is set, and the cloth is as before.
  bool is_undone = false;
  // What the step took of all threads that had part in it [us]; 0: the backend cannot tell.
  double thread_us = 0;
  bool converged = true;  // every substep met the tolerance; true when the tolerance is 0
  FaultReason fault = FaultReason::kNone;
  StepWarnings warnings;
  Measurements measured;                           // zero unless requested
  std::shared_ptr<const StepImpulses> impulses{};  // null unless requested, and of faulted cloths
  // After the step, StepItem::energy included. None: something else may have part in it (what is
  // stored, colliders, pins that move, wind, other cloths of its world), or the backend cannot
  // tell.
  std::optional<EnergyBalance> energy{};
  // Of every body, by collider; null without bodies, and of faulted cloths.
  std::shared_ptr<const std::vector<BodyState>> bodies{};
};

}  // namespace drape
