#include "server/solver/step_plan.h"

#include <algorithm>
#include <limits>

#include "server/solver/collider_contact.h"
#include "server/solver/force_limits.h"
#include "server/solver/hinge_stages.h"
#include "server/solver/load.h"
#include "server/solver/solver_constants.h"

namespace drape {
namespace {

// SolverChoice::end_share.
double EndShare(const SceneModel& model, const ClothParameters& parameters) {
  switch (parameters.settings.direction) {
    case Direction::kAtEnd:
      return 1;
    case Direction::kAtStart:
      return 0;
    case Direction::kBlended:
      break;
  }
  // Strips leave much of the errors there, and start directions turn those into energy. What bodies
  // give to a cloth is not watched (energy_watch.h).
  if (model.held_mass_ratio() > kMaxHeldMassRatio || HasBodies(parameters.colliders)) return 1;
  const auto share = [](double gamma, double begin, double end) {
    return std::clamp((gamma - begin) / (end - begin), 0.0, 1.0);
  };
  const double by_weight = share(WeightGamma(model, parameters), kBlendBegin, kBlendEnd);
  // A chain or a tree has no cells that could flutter.
  const bool has_cells = model.constraint_count() >= model.particle_count();
  if (!has_cells) return by_weight;
  return std::max(by_weight, share(LoadRatio(model, parameters), kWhipBegin, kWhipEnd));
}

// Strips hold plain constraints of the model's lengths only.
bool HasStrips(const SceneModel& model, const StepSettings& settings, LengthSource lengths) {
  return settings.sweep == Sweep::kStrips && !model.has_inequalities() &&
         lengths == LengthSource::kModel;
}

// One step along start directions keeps energy, two steps lose it to every motion that is fast for
// a substep. Where sweeps end at a tolerance, each particle hangs by a strip and masses are alike,
// start directions are stable too; on sheets that hang by few pins, or by none, they gain energy.
// What a grip may pull is such a sheet, whatever its pins are.
bool KeepsEnergy(const SceneModel& model, const ClothParameters& parameters) {
  const StepSettings& settings = parameters.settings;
  return settings.tolerance > 0 && parameters.max_grips == 0 &&
         settings.direction == Direction::kBlended && model.hangs_by_strips() &&
         model.link_mass_ratio() <= kMaxHeldMassRatio && !model.has_compliance() &&
         parameters.colliders.empty() && ElasticRatio(model, parameters) <= 1 &&
         EndShare(model, parameters) == 0 && LoadRatio(model, parameters) <= kWhipBegin;
}

// Two steps need strips: springs alone are integrated better by velocity Verlet, and the errors
// that colours and joints leave would gain energy, as would those that strips leave where masses
// differ much (kMaxHeldMassRatio). Impulses between a cloth and a body count once.
bool HasTwoSteps(const SceneModel& model, const ClothParameters& parameters,
                 const SolverChoice& choice) {
  const StepSettings& settings = parameters.settings;
  return settings.integration == Integration::kTwoStep && choice.has_strips &&
         settings.substeps > 1 && model.constraint_count() > 0 && model.joint_count() == 0 &&
         !choice.has_spring_forces && model.held_mass_ratio() <= kMaxHeldMassRatio &&
         !HasBodies(parameters.colliders) && !KeepsEnergy(model, parameters);
}

// Kicks follow what is no faster than h^2 omega^2 = 1, and are cheaper than lines, which are stable
// at any strength.
bool HasElasticLines(const SceneModel& model, const ClothParameters& parameters) {
  return !model.elastic_lines().empty() && ElasticRatio(model, parameters) > 1;
}

// Whether strips cross in the many phases of a mesh.
bool CrossesOften(const SceneModel& model) {
  return model.strips().phase_count_there > 2;
}

// SolverChoice::link_lead. What one sweep through the many phases of a mesh leaves of the errors of
// its links feeds vibrations that two steps hardly damp (tests/bench/notes/solver.md).
double LeadOfLinks(const SceneModel& model, const StepSettings& settings,
                   const SolverChoice& choice) {
  return choice.has_two_steps && settings.tolerance == 0 && CrossesOften(model) &&
                 model.has_compliance()
             ? kLinkLead
             : 0;
}

// SolverChoice::remainder_speed_m_per_s. In the many phases of a mesh rounding errors show in any
// motion. In grids and chains they keep from resting what else would, and only there are they worth
// what it costs to carry remainders.
double RemainderSpeed_m_per_s(const SceneModel& model, const SolverChoice& choice) {
  if (!choice.has_two_steps) return 0;
  return CrossesOften(model) ? std::numeric_limits<double>::infinity() : kCalmSpeed_m_per_s;
}

// SolverChoice::hinge_period: of slow hinges of meshes by two steps, which gain no energy so
// (tests/solver/substep_schedule_test.cpp).
uint32_t PeriodOfHinges(const SceneModel& model, const ClothParameters& parameters,
                        const SolverChoice& choice) {
  if (!choice.has_two_steps || model.elastic_count() == 0 || model.grid_columns() > 0) return 1;
  const double ratio = ElasticRatio(model, parameters);
  uint32_t longest = 1;
  for (uint32_t period = 2; period <= kMaxHingePeriod; ++period) {
    // Where fewer substeps are left for the last force, some frequencies would grow.
    const bool divides_step = parameters.settings.substeps % period == 0;
    if (divides_step && period * period * ratio <= kMaxSharedHingeRatio) longest = period;
  }
  return longest;
}

// SolverChoice::hinge_stages. Kicks follow what is no faster than h^2 omega^2 = 1.
uint32_t StagesOfHinges(const SceneModel& model, const ClothParameters& parameters,
                        const SolverChoice& choice) {
  if (choice.hinge_period > 1) return 1;
  if (choice.has_elastic_lines || ElasticRatio(model, parameters) <= 1) return 0;
  const SubstepSchedule schedule(parameters.settings, choice.has_two_steps, false);
  return HingeStageCount(schedule.largest_force_interval_s2() * model.elastic_frequency_sq_bound());
}

// StepPlan::max_elastic_frequency_sq_per_s2. h^2 omega^2 bounds what lines are limited by, s k
// times the inverse masses of every element.
double LargestElasticFrequencySq_per_s2(const StepSettings& settings, const SolverChoice& choice,
                                        const SubstepSchedule& schedule) {
  if (choice.hinge_stages > 0) {
    return LargestHingeRatio(choice.hinge_stages) / schedule.largest_force_interval_s2();
  }
  const double h = settings.substep_s();
  return (choice.has_elastic_lines ? kMaxLineRatio : 1) / (h * h);
}

// Refinement is off
// - where the start positions do not meet the lengths: contradictory lengths would gain energy in
//   every step;
// - where strips need other than two phases: one phase leaves no errors, the many phases of a mesh
//   leave errors everywhere;
// - with compliance, which leaves no strain to measure errors by;
// - along start directions, whose turning links are left to the substeps.
bool HasRefinement(const SceneModel& model, const StepSettings& settings,
                   const SolverChoice& choice) {
  return settings.refine_above_strain > 0 && choice.has_strips &&
         model.start_errors().max <= settings.refine_above_strain &&
         model.strips().phase_count_there == 2 && choice.end_share == 1 && !model.has_compliance();
}

// Never below the tolerance: a sweep that changed nothing has left nothing to refine. Never more
// rounds than substeps: with few substeps, many rounds removed less than a few
// (tests/bench/notes/solver.md).
void ChooseRefinement(const SceneModel& model, const StepSettings& settings, SolverChoice& choice) {
  if (!HasRefinement(model, settings, choice)) return;
  choice.refine_above_strain = std::max(settings.refine_above_strain, settings.tolerance);
  choice.refine_rounds = std::min(settings.substeps, kMaxRefineRounds);
  const double links = double{1} * model.constraint_count() * settings.substeps;
  choice.refine_solves = static_cast<uint32_t>(std::min(links * kRefineShare, 4e9));
}

// SolverChoice::span_give. Sweeps that end at a tolerance find directions and impulses that suit
// each other.
double SpanGive(const SceneModel& model, const ClothParameters& parameters,
                const SolverChoice& choice) {
  if (!choice.has_strips || !model.has_spans() || parameters.settings.tolerance > 0) return 0;
  const double load = OwnLoadRatio(model, parameters);
  if (load < kLeastSpanLoad) return 0;
  const double counted = std::min(load, kMostSpanLoad);
  return kSpanGive * counted * counted;
}

SolverChoice ChooseSolver(const SceneModel& model, const ClothParameters& parameters,
                          LengthSource lengths) {
  const StepSettings& settings = parameters.settings;
  SolverChoice choice;
  choice.has_strips = HasStrips(model, settings, lengths);
  choice.has_spring_forces =
      model.spring_count() > 0 && settings.spring_integration == SpringIntegration::kInForce;
  choice.has_two_steps = HasTwoSteps(model, parameters, choice);
  choice.has_quiet_links =
      choice.has_strips && !parameters.colliders.empty() && parameters.friction_static > 0;
  choice.has_surface_contacts = HasSurfaceContacts(model, parameters);
  if (!choice.has_two_steps) {
    choice.end_share = EndShare(model, parameters);
    if (lengths == LengthSource::kModel) choice.velocity_iterations = settings.velocity_iterations;
  }
  choice.has_elastic_lines = HasElasticLines(model, parameters);
  choice.hinge_period = PeriodOfHinges(model, parameters, choice);
  choice.link_lead = LeadOfLinks(model, settings, choice);
  choice.remainder_speed_m_per_s = RemainderSpeed_m_per_s(model, choice);
  choice.hinge_stages = StagesOfHinges(model, parameters, choice);
  choice.span_give = SpanGive(model, parameters, choice);
  ChooseRefinement(model, settings, choice);
  return choice;
}

StageSet ChooseStages(const SceneModel& model, const ClothParameters& parameters,
                      LengthSource lengths, const SolverChoice& solver) {
  using enum StepStage;
  const StepSettings& settings = parameters.settings;
  const bool has_grid_cells = model.grid_columns() > 1 && model.grid_rows() > 1;
  const bool has_contacts = !parameters.colliders.empty();
  const bool feels_air = parameters.air_drag > 0 || parameters.air_lift > 0;
  StageSet stages = {kPredict, kIntegrate, kCommit, kMeasure};
  stages.Add(kApplySprings, model.spring_count() > 0 && !solver.has_spring_forces);
  stages.Add(kSolveElastic, solver.has_elastic_lines);
  stages.Add(kSolveHinges, solver.hinge_stages > 0);
  stages.Add(kApplyElastic,
             model.elastic_count() > 0 && !stages.HasAnyOf({kSolveElastic, kSolveHinges}));
  stages.Add(kApplyWind, feels_air && !model.triangles().empty());
  stages.Add(kDampTwist, settings.twist_damping_per_s > 0 && has_grid_cells);
  // Tethers are as long as the model's cloth: a cloth with driven lengths has none.
  stages.Add(kTether,
             settings.use_tethers && !model.tethers().empty() && lengths == LengthSource::kModel);
  stages.Add(solver.has_strips ? kSolveStrips : kSolveDistance);
  stages.Add(kRefine, solver.refine_above_strain > 0);
  stages.Add(kSolveJoints, model.joint_count() > 0);
  stages.Add(kSolveContacts, has_contacts);
  stages.Add(kSolveVelocity, solver.velocity_iterations > 0);
  const bool touches_itself = parameters.self_collision && !model.triangles().empty();
  for (const StepStage stage : {kFindSelfContacts, kSolveSelfContacts, kGuardSelfContacts}) {
    stages.Add(stage, touches_itself);
  }
  stages.Add(kCorrectVelocity, has_contacts || parameters.damping_per_s > 0);
  return stages;
}

// Below about 4 ulp(|p|) / rest length no sweep ever meets the tolerance: two positions are rounded
// when stored, and so is their difference.
double ResolvableTolerance(double tolerance, const SceneModel& model, ScalarType scalar) {
  if (tolerance <= 0) return 0;
  const double ulp = scalar == ScalarType::kFloat32 ? std::numeric_limits<float>::epsilon()
                                                    : std::numeric_limits<double>::epsilon();
  return std::max(tolerance, 4 * ulp * model.resolution_ratio());
}

// Soft links may stretch as one that the whole weight hangs on would.
double StrainLimit(const SceneModel& model, const ClothParameters& parameters) {
  const double weight_n = model.total_mass_kg() * parameters.gravity_m_per_s2.norm();
  return kStrainLimit + weight_n * model.mean_softness_per_n();
}

}  // namespace

StepPlan PlanStep(const SceneModel& model, const ClothParameters& parameters, LengthSource lengths,
                  ScalarType scalar) {
  const StepSettings& settings = parameters.settings;
  const SolverChoice solver = ChooseSolver(model, parameters, lengths);
  const StageSet stages = ChooseStages(model, parameters, lengths, solver);
  const double tolerance = ResolvableTolerance(settings.tolerance, model, scalar);
  const SubstepSchedule schedule(settings, solver.has_two_steps, stages.Has(StepStage::kDampTwist),
                                 solver.hinge_period, solver.link_lead);
  const double max_frequency_sq_per_s2 =
      LargestElasticFrequencySq_per_s2(settings, solver, schedule);
  // Springs are judged as if the cloth had its model's lengths, to which it may return any time.
  const bool may_have_two_steps =
      ChooseSolver(model, parameters, LengthSource::kModel).has_two_steps;
  return {.stages = stages,
          .solver = solver,
          .schedule = schedule,
          .tolerance = tolerance,
          .known_warnings =
              {.tolerance_raised = tolerance > settings.tolerance,
               .springs_beyond_limit = AreSpringsBeyondLimit(model, parameters, may_have_two_steps),
               .elastic_beyond_limit = model.elastic_frequency_sq_bound() > max_frequency_sq_per_s2,
               .springs_gain_energy = SpringGain_per_s(model, parameters) > kMaxSpringGain_per_s},
          .strain_limit = StrainLimit(model, parameters),
          .max_elastic_frequency_sq_per_s2 = max_frequency_sq_per_s2};
}

}  // namespace drape
