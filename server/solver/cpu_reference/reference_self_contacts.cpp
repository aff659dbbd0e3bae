#include "server/solver/cpu_reference/reference_self_contacts.h"

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape::reference {

namespace {

using self_contact::FromVector;

std::vector<SelfVector> ToVectors(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<SelfVector> result;
  for (const Eigen::Vector3d& v : vectors) result.push_back(self_contact::ToVector<SelfVector>(v));
  return result;
}

void Assign(const std::vector<SelfVector>& vectors, std::vector<Eigen::Vector3d>& result) {
  for (size_t i = 0; i < vectors.size(); ++i) result[i] = FromVector(vectors[i]);
}

// Those of the substep that ends.
void TakePulls(StepContext& context) {
  if (context.impulses == nullptr) return;
  ReferenceSelfContacts& self = context.self_contacts;
  for (const Grip& held : context.held) {
    const uint32_t i = held.particle;
    context.impulses->ToHeld(i, FromVector(self.pulls[i]));
    context.impulses->ToHeldInMemory(i, FromVector(self.pulls_in_memory[i]));
    self.pulls[i] = self.pulls_in_memory[i] = SelfVector{};
  }
}

}  // namespace

bool BeginSelfContacts(StepContext& context, const ContactSurface* surface, bool may_cross) {
  if (!context.plan.Has(StepStage::kFindSelfContacts)) return false;
  const ClothParameters& parameters = context.parameters;
  const SelfContactNumbers numbers = SelfContactOf(parameters);
  ReferenceSelfContacts& self = context.self_contacts;
  if (context.impulses != nullptr) {
    self.pulls.assign(context.model.particle_count(), SelfVector{});
    self.pulls_in_memory = self.pulls;
  }
  const self_contact::StepNumbers<SelfVector> step{
      .thickness = numbers.thickness_m,
      .friction_static = numbers.friction_static,
      .friction_dynamic = numbers.friction_dynamic,
      .depenetration_speed = kMaxDepenetrationSpeed_m_per_s,
      .gravity = parameters.gravity_m_per_s2.norm(),
      .slowest_landing = SlowestLanding(parameters),
      .grazing_sine = kGrazingSine,
      .touch_round_offs = kTouchRoundOffs,
      .edge_length = context.model.length_scale_m(),
      .time_step = parameters.settings.time_step_s,
      .substeps = context.plan.schedule.size(),
      .has_two_steps = context.plan.solver.has_two_steps,
      .inverse_masses = context.w,
      .pulls = {self.pulls, self.pulls_in_memory}};
  return context.self_contacts.contacts.Begin(*surface, step, may_cross,
                                              ToVectors(context.state.positions_m));
}

void FindSelfContacts(StepContext& context) {
  if (!context.plan.Has(StepStage::kFindSelfContacts)) return;
  // Predict has not changed the state itself.
  context.self_contacts.starts = ToVectors(context.state.positions_m);
  context.self_contacts.contacts.Find(context.self_contacts.starts,
                                      ToVectors(context.state.velocities_m_per_s));
}

bool SolveSelfContacts(StepContext& context) {
  if (!context.plan.Has(StepStage::kSolveSelfContacts)) return false;
  const std::vector<SelfVector> base = ToVectors(context.base);
  std::vector<SelfVector> u = ToVectors(context.u);
  const double least_change = context.plan.tolerance * context.model.length_scale_m() / context.h;
  const bool has_changed = context.self_contacts.contacts.Solve(
      context.self_contacts.starts.data(), base.data(), u.data(), context.h, least_change);
  Assign(u, context.u);
  return has_changed;
}

void GuardSelfContacts(StepContext& context) {
  if (!context.plan.Has(StepStage::kGuardSelfContacts)) return;
  ReferenceSelfContacts& self = context.self_contacts;
  std::vector<SelfVector> ends = ToVectors(context.state.positions_m);
  std::vector<SelfVector> velocities = ToVectors(context.state.velocities_m_per_s);
  std::vector<SelfVector> previous_positions = ToVectors(context.previous.positions_m);
  std::vector<SelfVector> previous_velocities = ToVectors(context.previous.velocities_m_per_s);
  self_contact::PlanarGuard<SelfVector>::Motion motion{.starts = self.starts,
                                                       .ends = ends,
                                                       .velocities = velocities,
                                                       .previous_velocities = {},
                                                       .previous_positions = {},
                                                       .inverse_masses = context.w,
                                                       .duration = context.substep.duration_s};
  if (context.substep.is_two_step) {
    motion.previous_velocities = previous_velocities;
    motion.previous_positions = previous_positions;
  }
  self.has_failed |= !self.contacts.Guard(motion);
  TakePulls(context);
  Assign(ends, context.state.positions_m);
  Assign(velocities, context.state.velocities_m_per_s);
  if (!context.substep.is_two_step) return;
  Assign(previous_positions, context.previous.positions_m);
  Assign(previous_velocities, context.previous.velocities_m_per_s);
}

void MeasureSelfContacts(const ContactSurface& surface, const ClothParameters& parameters,
                         const ParticleState& state, Measurements& measured) {
  const self_contact::SelfContactMeasures measures = self_contact::MeasureSelfContacts(
      surface, SelfContactOf(parameters).thickness_m, ToVectors(state.positions_m));
  measured.near_pairs = measures.near_pairs;
  measured.smallest_distance_m = measures.smallest_distance_m;
  measured.crossings = measures.crossings;
}

}  // namespace drape::reference
