#include "server/solver/cpu/alone/self_contacts.h"

#include <algorithm>

#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

bool TouchesItself(const StepContext& context) {
  return context.controls.self_contact.has_value();
}

}  // namespace

bool BeginSelfContacts(const StepContext& context) {
  if (!TouchesItself(context)) return false;
  const FloatControls& controls = context.controls;
  StepScratch& scratch = context.scratch;
  if (scratch.self_contacts == nullptr) {
    scratch.self_contacts = std::make_shared<SelfContactMemory>();
  }
  SelfContactMemory& memory = *scratch.self_contacts;
  memory.pulls.clear();
  if (context.impulses() != nullptr) memory.pulls.resize(context.model.particle_count);
  memory.pulls_in_memory = memory.pulls;
  const SelfContactNumbers& numbers = *controls.self_contact;
  const self_contact::StepNumbers<Vec4> step{
      .thickness = static_cast<float>(numbers.thickness_m),
      .friction_static = static_cast<float>(numbers.friction_static),
      .friction_dynamic = static_cast<float>(numbers.friction_dynamic),
      .depenetration_speed = static_cast<float>(kMaxDepenetrationSpeed_m_per_s),
      .gravity = Length(controls.gravity),
      .slowest_landing = controls.slowest_landing,
      .grazing_sine = static_cast<float>(kGrazingSine),
      .touch_round_offs = static_cast<float>(kTouchRoundOffs),
      .edge_length = context.model.length_scale,
      .time_step = controls.time_step,
      .substeps = controls.plan.schedule.size(),
      .has_two_steps = controls.plan.solver.has_two_steps,
      .inverse_masses = context.held.inverse_masses,
      .pulls = {memory.pulls, memory.pulls_in_memory}};
  return memory.contacts.Begin(*context.contact_surface, step, context.may_cross_itself,
                               scratch.state.positions);
}

void FindSelfContacts(const StepContext& context) {
  if (!TouchesItself(context)) return;
  StepScratch& scratch = context.scratch;
  SelfContactMemory& memory = *scratch.self_contacts;
  // With two steps the predicted state has replaced the one before, which `previous` holds.
  if (context.substep.is_two_step) {
    memory.contacts.Find(scratch.previous.positions, scratch.previous.velocities);
    return;
  }
  memory.starts = scratch.state.positions;
  memory.contacts.Find(memory.starts, scratch.state.velocities);
}

bool SolveSelfContacts(const StepContext& context) {
  if (!TouchesItself(context)) return false;
  StepScratch& scratch = context.scratch;
  FloatState& state = scratch.state;
  const std::vector<Vec4>& starts =
      context.substep.is_two_step ? scratch.previous.positions : scratch.self_contacts->starts;
  const float interval = context.substep.interval;
  return scratch.self_contacts->contacts.Solve(starts.data(), state.positions.data(),
                                               state.velocities.data(), interval,
                                               context.controls.contact_tolerance / interval);
}

uint32_t SweepsAfterHits(const StepContext& context) {
  if (!TouchesItself(context)) return context.max_iterations;
  return context.scratch.self_contacts->contacts.SweepsOf(context.max_iterations);
}

void GuardSelfContacts(const StepContext& context) {
  if (!TouchesItself(context)) return;
  StepScratch& scratch = context.scratch;
  SelfContactMemory& memory = *scratch.self_contacts;
  const uint32_t count = context.model.particle_count;
  const auto first = [&](std::vector<Vec4>& vectors) { return std::span(vectors).first(count); };
  self_contact::PlanarGuard<Vec4>::Motion motion{
      .starts = first(context.substep.is_two_step ? scratch.previous.positions : memory.starts),
      .ends = first(scratch.state.positions),
      .velocities = first(scratch.state.velocities),
      .previous_velocities = {},
      .previous_positions = {},
      .inverse_masses = context.held.inverse_masses,
      .duration = context.controls.h};
  if (context.substep.is_two_step) {
    motion.previous_velocities = first(scratch.previous.velocities);
    motion.previous_positions = first(scratch.previous.positions);
  }
  scratch.self_contacts_failed |= !memory.contacts.Guard(motion);
  context.ForHeldAsked([&](uint32_t i, ImpulseSums& sums) {
    sums.Pull(i, memory.pulls[i]);
    sums.PullInMemory(i, memory.pulls_in_memory[i]);
    memory.pulls[i] = memory.pulls_in_memory[i] = Vec4{};
  });
}

}  // namespace drape::cpu
