#include "server/solver/gl_compute/gl_cloth.h"

#include <algorithm>
#include <cmath>

#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "server/solver/gl_compute/strip_rows.h"
#include "server/solver/solver_constants.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

shader::vec4 ToVec4(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), 0};
}

// Zero unless there is a refinement.
void SetRefinement(const StepPlan& plan, shader::StepNumbers& step) {
  if (!plan.Has(StepStage::kRefine)) return;
  // Never below the tolerance in use: a sweep that changed nothing has left nothing to refine.
  const double limit = std::max(plan.solver.refine_above_strain, plan.tolerance);
  step.shortest_sq = static_cast<float>((1 - limit) * (1 - limit));
  step.longest_sq = static_cast<float>((1 + limit) * (1 + limit));
  step.refine_rounds = plan.solver.refine_rounds;
  step.refine_solves = plan.solver.refine_solves;
}

void SetEnergyLimit(const GlCloth& cloth, shader::ClothRecord& record) {
  const EnergyLimit limit = EnergyLimitOf(
      *cloth.model->model, cloth.parameters,
      cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel, cloth.plan);
  if (!limit.is_watched) return;
  shader::StepNumbers& step = record.step;
  step.energy_constant = static_cast<float>(limit.Allowed_j(0));
  step.energy_lag_root = static_cast<float>(limit.lag_root_j);
  step.keeps_start_of_gain = cloth.gain_response == GainResponse::kStepAgain ? 1 : 0;
  record.watches_stores = limit.watches_stores ? 1 : 0;
}

shader::StepNumbers NumbersOf(const GlCloth& cloth) {
  const ClothParameters& parameters = cloth.parameters;
  const StepPlan& plan = cloth.plan;
  const double h = parameters.settings.substep_s();
  const double length_scale = cloth.model->model->length_scale_m();
  shader::StepNumbers step{};
  step.gravity = ToVec4(parameters.gravity_m_per_s2);
  step.wind = ToVec4(parameters.wind_m_per_s);
  step.substeps = plan.schedule.size();
  step.max_iterations = cloth.max_iterations;
  step.velocity_iterations = plan.solver.velocity_iterations;
  step.h = static_cast<float>(h);
  step.inverse_h = static_cast<float>(1 / h);
  step.tolerance = static_cast<float>(plan.tolerance);
  step.contact_tolerance = static_cast<float>(plan.tolerance * length_scale);
  step.end_share = static_cast<float>(plan.solver.end_share);
  step.thickness = static_cast<float>(parameters.thickness_m);
  step.friction_static = static_cast<float>(parameters.friction_static);
  step.friction_dynamic = static_cast<float>(parameters.friction_dynamic);
  step.restitution = static_cast<float>(parameters.restitution);
  step.slowest_rebound = static_cast<float>(SlowestRebound(parameters));
  step.slowest_landing = static_cast<float>(SlowestLanding(parameters));
  step.max_depenetration = static_cast<float>(kMaxDepenetrationSpeed_m_per_s * h);
  step.contact_margin = static_cast<float>(kContactMarginRatio * length_scale);
  step.reach_margin = static_cast<float>(kReachMarginRatio * length_scale);
  step.air_drag = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_drag / 4);
  step.air_lift = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_lift / 4);
  step.max_elastic_frequency_sq = static_cast<float>(plan.max_elastic_frequency_sq_per_s2);
  if (cloth.touches_itself()) step.self_contacts = cloth.contact_words.begin();
  SetRefinement(plan, step);
  return step;
}

shader::SubstepRecord ToRecord(const Substep& substep, uint32_t index, double damping_per_s) {
  const double h = substep.interval_s;
  return {.interval = static_cast<float>(h),
          .inverse_interval = static_cast<float>(1 / h),
          .link_interval = static_cast<float>(substep.link_interval_s),
          .inverse_link_interval = static_cast<float>(1 / substep.link_interval_s),
          .inverse_duration = static_cast<float>(1 / substep.duration_s),
          .damping_factor = static_cast<float>(substep.is_two_step
                                                   ? 1 / (1 + damping_per_s * substep.kick_within_s)
                                                   : std::exp(-damping_per_s * h)),
          .pin_lead = static_cast<float>(1 - h / substep.duration_s),
          .pin_end = index + substep.pin_shares,
          .kick_before = static_cast<float>(substep.kick_before_s),
          .kick_within = static_cast<float>(substep.kick_within_s),
          .kick_after = static_cast<float>(substep.kick_after_s),
          .twist_share = static_cast<float>(substep.twist_share),
          .lead = static_cast<float>(substep.lead_s)};
}

// One record of each kind that the schedule has.
void SetSubsteps(const SubstepSchedule& schedule, double damping_per_s,
                 shader::ClothRecord& record) {
  static_assert(kTwistPeriod == DRAPE_SUBSTEP_CYCLE, "substeps of one kind are alike");
  const auto set = [&](uint32_t index) {
    record.substeps[shader::SubstepKindOf(index, schedule.size())] =
        ToRecord(schedule[index], index, damping_per_s);
  };
  const uint32_t kinds = std::min<uint32_t>(schedule.size(), DRAPE_SUBSTEP_KINDS);
  for (uint32_t index = 0; index < kinds; ++index) set(index);
  set(schedule.size() - 1);
}

void SetModel(const GlCloth& cloth, shader::ClothRecord& record) {
  const SceneModel& model = *cloth.model->model;
  record.model = Placed(cloth.model->layout, cloth.model->words.begin());
  record.particle_count = model.particle_count();
  record.pin_count = model.pin_count() + cloth.parameters.max_grips;
  record.has_grips = cloth.parameters.max_grips > 0 ? 1 : 0;
  record.constraint_count = model.constraint_count();
  record.colour_count = model.colour_count();
  record.joint_count = model.joint_count();
  record.joint_colour_count = model.joint_colour_count();
  record.elastic_count = model.elastic_count();
  if (cloth.plan.Has(StepStage::kSolveElastic)) {
    record.elastic_family_count = static_cast<uint32_t>(model.elastic_lines().families.size());
  }
  if (cloth.plan.Has(StepStage::kApplyWind)) {
    record.triangle_count = static_cast<uint32_t>(model.triangles().size());
  }
  record.hinge_stage_count = cloth.plan.solver.hinge_stages;
  record.hinge_period = cloth.plan.solver.hinge_period;
  record.strip_phase_count = model.strips().phase_count();
  record.span_give = static_cast<float>(cloth.plan.solver.span_give);
  record.strip_levels = StripLevels(model, !cloth.kernels->variant.is_tiled());
  record.strip_all_levels = AllStripLevels(model.strips());
  record.grid_columns = model.grid_columns();
  record.grid_rows = model.grid_rows();
  record.measure_piece_count = MeasurePieceCount(model);
  record.is_tiled = cloth.kernels->variant.is_tiled() ? 1 : 0;
  record.has_springs = model.spring_count() > 0 ? 1 : 0;
  record.has_compliance = model.has_compliance() ? 1 : 0;
  record.has_joint_compliance = model.has_joint_compliance() ? 1 : 0;
  record.has_inequalities = model.has_inequalities() ? 1 : 0;
}

}  // namespace

shader::SelfContactRecord MakeSelfContactRecord(const GlCloth& cloth) {
  shader::SelfContactRecord record = PlacedSelfContacts(
      cloth.contacts,
      {cloth.model->words.begin(), cloth.contact_words.begin(), cloth.scratch.begin()},
      cloth.parameters, cloth.model->model->length_scale_m());
  record.may_grow = cloth.may_take_more_pairs ? 1 : 0;
  record.has_crossings = cloth.crossing_flags.empty() ? 0 : 1;
  return record;
}

shader::ClothRecord MakeClothRecord(const GlCloth& cloth) {
  shader::ClothRecord record{};
  record.step = NumbersOf(cloth);
  SetEnergyLimit(cloth, record);
  SetSubsteps(cloth.plan.schedule, cloth.parameters.damping_per_s, record);
  SetModel(cloth, record);
  record.parameters = Placed(cloth.parameter_layout, cloth.parameter_words.begin());
  record.scratch = Placed(cloth.scratch_layout, cloth.scratch.begin());
  record.positions = cloth.state.begin();
  record.velocities = cloth.state.begin() + 3 * cloth.particle_count();
  record.collider_count = static_cast<uint32_t>(cloth.parameters.colliders.size());
  record.has_moving_colliders = HasMovingColliders(cloth.parameters) ? 1 : 0;
  record.has_own_lengths = cloth.has_own_lengths() ? 1 : 0;
  if (cloth.impulses.is_made()) record.impulses = cloth.impulses.words.begin();
  if (cloth.kernels->variant.is_in_parts()) {
    // Each of them is below the budget, a 32-bit number.
    record.sweep_cost = static_cast<uint32_t>(cloth.costs.sweep);
    record.substep_cost = static_cast<uint32_t>(cloth.costs.substep);
    record.fixed_cost = static_cast<uint32_t>(cloth.costs.fixed);
  }
  return record;
}

}  // namespace drape
