// A step of one cloth, decided once: everything that follows from its model and parameters alone.
// Backends, costs and reports read it; none of them decides again.
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>

#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/scalar_type.h"
#include "server/solver/step_report.h"
#include "server/solver/step_stage.h"
#include "server/solver/substep_schedule.h"

namespace drape {

// The source of a cloth's rest lengths: its model, or driven lengths of its own (ClothUpdate).
enum class LengthSource { kModel, kOwn };

// How the sweeps solve and how the substeps advance: the settings, restricted to those that suit
// the cloth.
struct SolverChoice {
  bool has_strips = false;  // the links are solved by strips, else by colours
  bool has_two_steps = false;
  // The elastic elements are solved line by line (`solve_elastic`), not by kicks.
  bool has_elastic_lines = false;
  // Hinges are solved in this many stages (`solve_hinges`), not by kicks; 0: by kicks.
  uint32_t hinge_stages = 0;
  // Substeps that share the forces of slow hinges; more than 1: in one stage.
  uint32_t hinge_period = 1;
  // Single precision: what rounding takes from positions is carried from substep to substep, in
  // steps that begin with no particle faster than this [m/s]; infinite: in all.
  double remainder_speed_m_per_s = 0;
  // Strips look ahead of the end of a substep by this many of its intervals (33a of method.md).
  double link_lead = 0;
  bool has_spring_forces = false;  // springs act within the substep (IN_FORCE), not by kicks
  // Single precision: links within rounding of their length do not pull what friction holds. Only
  // strips know it.
  bool has_quiet_links = false;
  // The insides of edges and triangles may touch colliders, too: there are some that are neither
  // planes nor bodies.
  bool has_surface_contacts = false;
  // Weight of the end-of-substep direction in the direction of an impulse, [0, 1]; the
  // start-of-substep direction has the rest.
  double end_share = 1;
  uint32_t velocity_iterations = 0;  // sweeps of `solve_velocity`
  // The diagonals of links of spans (FindSpans) are larger by this share of themselves [-].
  double span_give = 0;
  // `refine`: the strain beyond which a link is moved; 0: no link is.
  double refine_above_strain = 0;
  uint32_t refine_rounds = 0;  // at most, per step
  uint32_t refine_solves = 0;  // no further round once this many links have been moved

  bool has_start_directions() const { return end_share < 1; }
  bool always_has_remainders() const { return std::isinf(remainder_speed_m_per_s); }
  friend auto operator<=>(const SolverChoice&, const SolverChoice&) = default;
};

struct StepPlan {
  StageSet stages;  // those that have anything to do
  SolverChoice solver;
  SubstepSchedule schedule;
  double tolerance = 0;         // settings.tolerance, raised to what the scalar type can resolve
  StepWarnings known_warnings;  // those that do not depend on the state
  double strain_limit = 0;      // a larger one has the warning strain_beyond_limit [-]
  // Elastic elements that are faster act as if they were not, and have the warning
  // elastic_beyond_limit. Lines have a limit of their own.
  double max_elastic_frequency_sq_per_s2 = 0;

  bool Has(StepStage stage) const { return stages.Has(stage); }
  friend auto operator<=>(const StepPlan&, const StepPlan&) = default;
};

// Pure; takes about a microsecond. Any thread.
StepPlan PlanStep(const SceneModel& model, const ClothParameters& parameters, LengthSource lengths,
                  ScalarType scalar);

}  // namespace drape
