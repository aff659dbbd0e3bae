#include "server/solver/gl_compute/layouts.h"

#include <algorithm>

#include "server/solver/gl_compute/kernel_variant.h"
#include "server/solver/solver_constants.h"
#include "shaders/interface/bindings.h"

namespace drape {

uint32_t MeasurePieceCount(const SceneModel& model) {
  const uint32_t longest = std::max({model.particle_count(), model.constraint_count(),
                                     model.joint_count(), model.elastic_count()});
  return (longest + DRAPE_MEASURE_PIECE - 1) / DRAPE_MEASURE_PIECE;
}

PackedLayout<shader::ParameterLayout> LayOutParameters(const PlannedCloth& cloth) {
  const ClothParameters& parameters = cloth.parameters;
  const uint64_t lengths = cloth.has_own_lengths() ? cloth.model.constraint_count() : 0;
  PackedLayout<shader::ParameterLayout> packed;
  shader::ParameterLayout& layout = packed.layout;
  const uint64_t grips = parameters.max_grips;
  layout.pin_targets = packed.Append(3 * (cloth.model.pin_count() + grips));
  layout.held = packed.Append(grips > 0 ? cloth.model.pin_count() + grips : 0);
  layout.inverse_masses = packed.Append(grips > 0 ? cloth.model.particle_count() : 0);
  layout.colliders = packed.Append(DRAPE_COLLIDER_WORDS * parameters.colliders.size());
  layout.collider_motions =
      packed.Append(DRAPE_COLLIDER_MOTION_WORDS * parameters.collider_motions.size());
  layout.length_starts = packed.Append(lengths);
  layout.length_targets = packed.Append(lengths);
  const uint64_t entries = cloth.plan.Has(StepStage::kSolveElastic)
                               ? cloth.model.elastic_lines().stiffnesses_n_per_m.size()
                               : 0;
  layout.elastic_entries = packed.Append(DRAPE_ELASTIC_ENTRY_WORDS * entries);
  // The calmer scheme (energy_watch.h), which writes its own, may have more of them.
  const bool has_hinges = cloth.model.elastic_count() > 0 && cloth.model.elastic_lines().empty();
  layout.hinge_stages = packed.Append(has_hinges ? 2 * kMaxHingeStages : 0);
  return packed;
}

PackedLayout<shader::ScratchLayout> LayOutScratch(const PlannedCloth& cloth, bool has_work_state) {
  const SceneModel& model = cloth.model;
  const ClothParameters& parameters = cloth.parameters;
  const StepPlan& plan = cloth.plan;
  const uint64_t particles = model.particle_count();
  const uint64_t colliders = parameters.colliders.size();
  PackedLayout<shader::ScratchLayout> packed;
  shader::ScratchLayout& layout = packed.layout;
  const auto append = [&packed](bool is_needed, uint64_t words) {
    return packed.Append(is_needed ? words : 0);
  };
  layout.lambdas =
      append(model.has_compliance() || model.has_inequalities(), model.constraint_count());
  layout.joint_lambdas = append(model.has_joint_compliance(), uint64_t{3} * model.joint_count());
  layout.normal_betas = packed.Append(colliders * particles);
  layout.tangent_betas = append(parameters.friction_static > 0, 3 * colliders * particles);
  layout.slidings = append(cloth.has_two_frictions(), colliders * particles);
  layout.rebounds = append(HasRestitution(parameters), colliders * particles);
  layout.violations = append(colliders > 0, particles);
  layout.met_colliders = append(colliders > 0, particles);
  layout.spring_accelerations = append(model.spring_count() > 0, 3 * particles);
  layout.elastic_impulses = packed.Append(
      uint64_t{3} * model.elastic_shares().impulses_per_element * model.elastic_count());
  layout.elastic_solutions =
      append(plan.Has(StepStage::kSolveElastic), DRAPE_ELASTIC_SOLUTION_WORDS * particles);
  layout.hinge_changes = append(plan.Has(StepStage::kSolveHinges), 3 * particles);
  layout.air_impulses = append(plan.Has(StepStage::kApplyWind), 3 * model.triangles().size());
  layout.previous_positions = append(plan.solver.has_two_steps, 3 * particles);
  layout.previous_velocities = append(plan.solver.has_two_steps, 3 * particles);
  layout.remainders = append(plan.solver.always_has_remainders(), 6 * particles);
  layout.twist_changes = append(plan.Has(StepStage::kDampTwist), 3 * particles);
  layout.strip_links = append(plan.Has(StepStage::kSolveStrips),
                              uint64_t{DRAPE_STRIP_LINK_WORDS} * model.strips().constraints.size());
  const bool lists_links = plan.Has(StepStage::kRefine) && !IsResident(cloth);
  layout.stretched_flags = append(lists_links, particles + 2 + model.colour_count());
  layout.refined_links = append(lists_links, model.constraint_count());
  layout.work_positions = append(has_work_state, 3 * particles);
  layout.work_velocities = append(has_work_state, 3 * particles);
  layout.quiet_flags = append(has_work_state && plan.solver.has_quiet_links, particles);
  layout.start_positions = packed.Append(3 * particles);
  const uint64_t pieces = MeasurePieceCount(model);
  layout.measured_pieces = append(pieces > 1, DRAPE_MEASURED_WORDS * pieces);
  return packed;
}

}  // namespace drape
