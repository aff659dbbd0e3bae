#include "server/solver/cpu/alone/surface_contacts.h"

#include <algorithm>
#include <span>

namespace drape::cpu {
namespace {

using Contacts = surface_contact::SurfaceContacts<Vec4>;

// Null: particles alone touch.
Contacts* ContactsOf(const StepContext& context) {
  const bool has_any =
      context.surface_parts != nullptr && context.controls.plan.solver.has_surface_contacts;
  return has_any ? &context.scratch.surface_contacts->contacts : nullptr;
}

std::span<const Vec4> Particles(const StepContext& context, const std::vector<Vec4>& vectors) {
  return std::span(vectors).first(context.model.particle_count);
}

// To the colliders and to what is held.
void PassOn(const StepContext& context, const Contacts& contacts) {
  ImpulseSums* const sums = context.impulses();
  if (sums == nullptr) return;
  const FloatState& state = context.scratch.state;
  const std::span<const uint32_t> near = context.scratch.reach.near;
  for (const auto* const active : contacts.active()) {
    const auto& contact = *active;
    const auto collider = static_cast<uint32_t>(contacts.solid(contact).place());
    const auto place = static_cast<size_t>(std::ranges::find(near, collider) - near.begin());
    for (uint32_t k = 0; k < contact.count; ++k) {
      const uint32_t i = contact.particles[k];
      const Vec4 given = contact.weights[k] * contact.given;
      const Vec4 in_memory = -contact.weights[k] * contact.given_in_memory;
      sums->Push(i, place, given, state.positions[i]);
      sums->PushInMemory(i, place, in_memory, state.positions[i]);
      if (context.held.inverse_masses[i] != 0) continue;
      sums->Pull(i, given);
      sums->PullInMemory(i, in_memory);
    }
  }
}

}  // namespace

void BeginSurfaceContacts(const StepContext& context) {
  if (context.surface_parts == nullptr || !context.controls.plan.solver.has_surface_contacts) {
    return;
  }
  StepScratch& scratch = context.scratch;
  if (scratch.surface_contacts == nullptr) {
    scratch.surface_contacts = std::make_shared<SurfaceContactMemory>();
  }
  const FloatControls& controls = context.controls;
  scratch.surface_contacts->contacts.Begin(
      *context.surface_parts,
      {.colliders = context.colliders,
       .motions = context.collider_motions,
       .places = scratch.reach.near,
       .thickness_m = controls.thickness_m,
       .edges = context.edges},
      {.gravity = controls.gravity,
       .friction_static = controls.friction_static,
       .friction_dynamic = controls.friction_dynamic,
       .restitution = controls.has_restitution ? controls.restitution : 0,
       .slowest_rebound = controls.slowest_rebound,
       .slowest_landing = controls.slowest_landing,
       .edge_length = context.model.length_scale,
       .time_step_s = controls.time_step_s,
       .substeps = controls.plan.schedule.size(),
       .has_two_steps = controls.plan.solver.has_two_steps,
       .inverse_masses = context.held.inverse_masses.first(context.model.particle_count),
       .interruption = context.interruption});
}

void FindSurfaceContacts(const StepContext& context) {
  if (Contacts* const contacts = ContactsOf(context)) {
    const FloatState& state = context.scratch.state;
    contacts->Find(Particles(context, state.positions), Particles(context, state.velocities));
  }
}

bool SolveSurfaceContacts(const StepContext& context) {
  Contacts* const contacts = ContactsOf(context);
  if (contacts == nullptr || contacts->active().empty()) return false;
  FloatState& state = context.scratch.state;
  const float interval = context.substep.interval;
  return contacts->Solve(state.positions.data(), state.velocities.data(), interval,
                         context.controls.contact_tolerance / interval);
}

void AdvanceSurfaceContacts(const StepContext& context) {
  if (Contacts* const contacts = ContactsOf(context)) {
    contacts->Advance(Particles(context, context.scratch.state.positions));
  }
}

bool GaveSurfaceContactsUp(const StepContext& context) {
  const Contacts* const contacts = ContactsOf(context);
  return contacts != nullptr && contacts->has_given_up();
}

void CorrectSurfaceContacts(const StepContext& context) {
  Contacts* const contacts = ContactsOf(context);
  if (contacts == nullptr || contacts->active().empty()) return;
  FloatState& state = context.scratch.state;
  FloatState& previous = context.scratch.previous;
  contacts->Correct(state.positions.data(), state.velocities.data(), previous.positions.data(),
                    previous.velocities.data());
  PassOn(context, *contacts);
}

}  // namespace drape::cpu
