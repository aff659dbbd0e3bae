#include "server/solver/cpu_reference/reference_surface_contacts.h"

#include <algorithm>
#include <numeric>

#include "server/solver/cpu_reference/reference_context.h"

namespace drape::reference {
namespace {

using Eigen::Vector3d;
using Vectors = std::vector<SurfaceVector>;

Vectors ToVectors(const std::vector<Vector3d>& vectors) {
  Vectors result;
  for (const Vector3d& v : vectors) result.push_back(self_contact::ToVector<SurfaceVector>(v));
  return result;
}

void FromVectors(const Vectors& vectors, std::vector<Vector3d>& result) {
  for (size_t i = 0; i < result.size(); ++i) result[i] = self_contact::FromVector(vectors[i]);
}

// In the step that is about to be done.
EdgesOfStep EdgesOf(const StepContext& context) {
  const StepSettings& settings = context.parameters.settings;
  const bool is_pulled = std::ranges::any_of(context.held, [&](const Grip& held) {
    return Pulls(context.state.positions_m[held.particle], held.target_m, settings.time_step_s);
  });
  double fastest_m_per_s = 0;
  for (const Vector3d& v : context.state.velocities_m_per_s) {
    fastest_m_per_s = std::max(fastest_m_per_s, v.norm());
  }
  const double way_m = WayInSubstep_m(fastest_m_per_s, context.parameters.gravity_m_per_s2.norm(),
                                      settings.time_step_s, settings.substeps);
  return {settings.collider_contact, context.model.length_scale_m(), is_pulled, way_m,
          settings.substep_s()};
}

}  // namespace

void ReferenceSurfaceContacts::Begin(const StepContext& context, const SurfaceParts* parts) {
  has_any_ = parts != nullptr && context.plan.solver.has_surface_contacts;
  if (!has_any_) return;
  const ClothParameters& parameters = context.parameters;
  inverse_masses_ = context.w;
  std::vector<uint32_t> places(parameters.colliders.size());
  std::iota(places.begin(), places.end(), 0u);
  contacts_.Begin(*parts,
                  {.colliders = parameters.colliders,
                   .motions = parameters.collider_motions,
                   .places = places,
                   .thickness_m = parameters.thickness_m,
                   .edges = EdgesOf(context)},
                  {.gravity = self_contact::ToVector<SurfaceVector>(parameters.gravity_m_per_s2),
                   .friction_static = parameters.friction_static,
                   .friction_dynamic = parameters.friction_dynamic,
                   .restitution = parameters.restitution,
                   .slowest_rebound = SlowestRebound(parameters),
                   .slowest_landing = SlowestLanding(parameters),
                   .edge_length = context.model.length_scale_m(),
                   .time_step_s = parameters.settings.time_step_s,
                   .substeps = parameters.settings.substeps,
                   .has_two_steps = context.plan.solver.has_two_steps,
                   .inverse_masses = inverse_masses_,
                   .interruption = context.interruption});
}

void ReferenceSurfaceContacts::Find(const StepContext& context) {
  if (!has_any_) return;
  contacts_.Find(ToVectors(context.state.positions_m), ToVectors(context.state.velocities_m_per_s));
}

bool ReferenceSurfaceContacts::Solve(StepContext& context) {
  if (!has_any_ || contacts_.active().empty()) return false;
  const Vectors base = ToVectors(context.base);
  Vectors u = ToVectors(context.u);
  const double least_m = context.plan.tolerance * context.model.length_scale_m();
  const bool has_changed = contacts_.Solve(base.data(), u.data(), context.h, least_m / context.h);
  FromVectors(u, context.u);
  return has_changed || context.plan.tolerance == 0;
}

double ReferenceSurfaceContacts::LargestError(const StepContext& context) const {
  if (!has_any_ || contacts_.active().empty()) return 0;
  return contacts_.LargestError(ToVectors(context.base).data(), ToVectors(context.u).data(),
                                context.h);
}

void ReferenceSurfaceContacts::Advance(const StepContext& context) {
  if (has_any_) contacts_.Advance(ToVectors(context.state.positions_m));
}

void ReferenceSurfaceContacts::Correct(StepContext& context) {
  if (!has_any_ || contacts_.active().empty()) return;
  const Vectors positions = ToVectors(context.state.positions_m);
  Vectors velocities = ToVectors(context.state.velocities_m_per_s);
  Vectors previous_positions = ToVectors(context.previous.positions_m);
  Vectors previous_velocities = ToVectors(context.previous.velocities_m_per_s);
  contacts_.Correct(positions.data(), velocities.data(), previous_positions.data(),
                    previous_velocities.data());
  FromVectors(velocities, context.state.velocities_m_per_s);
  FromVectors(previous_positions, context.previous.positions_m);
  FromVectors(previous_velocities, context.previous.velocities_m_per_s);
  PassOn(context);
}

void ReferenceSurfaceContacts::PassOn(const StepContext& context) const {
  if (context.impulses == nullptr) return;
  for (const auto* const active : contacts_.active()) {
    const auto& contact = *active;
    const size_t collider = contacts_.solid(contact).place();
    const Vector3d given = self_contact::FromVector(contact.given);
    const Vector3d in_memory = self_contact::FromVector(contact.given_in_memory);
    Vector3d place = Vector3d::Zero();
    for (uint32_t k = 0; k < contact.count; ++k) {
      const uint32_t i = contact.particles[k];
      place += contact.weights[k] * context.state.positions_m[i];
      context.impulses->OnParticle(i, collider, contact.weights[k] * given);
      context.impulses->OnParticleInMemory(i, collider, -contact.weights[k] * in_memory);
      if (context.w[i] != 0) continue;
      context.impulses->ToHeld(i, contact.weights[k] * given);
      context.impulses->ToHeldInMemory(i, -contact.weights[k] * in_memory);
    }
    const Vector3d arm = place - context.colliders.PivotAtEnd(collider);
    context.impulses->ToCollider(collider, -given, arm);
    context.impulses->ToColliderInMemory(collider, in_memory, arm);
  }
}

}  // namespace drape::reference
