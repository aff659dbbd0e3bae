#include "server/solver/cpu/alone/bodies.h"

#include <algorithm>
#include <limits>

namespace drape::cpu {
namespace {

using Eigen::Vector3d;

// Relative to the lengths that a distance is computed from: far above the rounding of its few
// operations, so that nothing in reach is left out.
constexpr float kReachRounding = 1e-5f;

// Where particles may touch a body.
class Reach {
 public:
  Reach(double radius_m, const Vector3d& centre_m) : radius_m_(radius_m) { MoveTo(centre_m); }
  void MoveTo(const Vector3d& centre_m) {
    centre_ = ToVec4(centre_m);
    const auto radius = static_cast<float>(radius_m_);
    const Vec4 size = Abs(centre_);
    const float widened = radius + kReachRounding * (radius + size[0] + size[1] + size[2]);
    radius_sq_ = widened * widened;
  }
  bool Has(Vec4 place) const {
    const Vec4 d = place - centre_;
    return !(Dot(d, d) > radius_sq_);  // what is no number, too
  }

 private:
  double radius_m_;
  Vec4 centre_{};
  float radius_sq_ = 0;
};

bodies::Particle ParticleOf(const StepContext& context, uint32_t i) {
  const bool is_free = context.held.IsFree(i);
  return {i, ToVector3d(context.scratch.state.positions[i]),
          is_free ? double{context.model.free_masses[i]} : std::numeric_limits<double>::infinity()};
}

// What the last contact of body k gave to a held particle, others get.
void PassOn(const StepContext& context, size_t k, uint32_t i) {
  ImpulseSums* const sums = context.impulses();
  if (sums == nullptr || context.held.IsFree(i)) return;
  sums->Pull(i, ToVec4(context.scratch.bodies.LastImpulse(k)));
}

}  // namespace

void BeginBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  bodies = {};
  if (!context.controls.has_bodies) return;
  bodies = Bodies(context.colliders, context.collider_motions, context.controls.bodies,
                  context.model.particle_count, std::numeric_limits<float>::epsilon() / 2);
}

void PredictBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  if (bodies.empty() || !bodies.HasRebounds()) return;
  const FloatState& state = context.scratch.state;
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (uint32_t i = 0; i < context.model.particle_count; ++i) {
      bodies.Predict(k, ParticleOf(context, i), ToVector3d(state.velocities[i]));
    }
  }
}

bool SolveBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  if (bodies.empty()) return false;
  FloatState& state = context.scratch.state;
  const float interval = context.substep.interval;
  double largest_change = 0;
  for (size_t k = 0; k < bodies.size(); ++k) {
    Reach reach(bodies.ReachOf(k), bodies.CentreAtEnd(k));
    const auto solve = [&](uint32_t i) {
      const bool is_near = reach.Has(state.positions[i] + interval * state.velocities[i]);
      if (!is_near && !bodies.HasPushed(k, i)) return;
      Vector3d u = ToVector3d(state.velocities[i]);
      const double change = bodies.Solve(k, ParticleOf(context, i), u);
      if (change == 0) return;
      state.velocities[i] = ToVec4(u);
      PassOn(context, k, i);
      largest_change = std::max(largest_change, change);
      reach.MoveTo(bodies.CentreAtEnd(k));
    };
    for (const uint32_t i : context.held.free_particles) solve(i);
    // What is held gives way to nothing, so it comes last.
    for (const uint32_t i : context.held.particles) solve(i);
  }
  largest_change = std::max(largest_change, bodies.SolveColliders());
  return double{interval} * largest_change > double{context.controls.contact_tolerance} ||
         context.controls.tolerance == 0;
}

void IntegrateBodies(const StepContext& context) {
  context.scratch.bodies.End();
}

void CorrectBodies(const StepContext& context) {
  Bodies& bodies = context.scratch.bodies;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < bodies.size(); ++k) {
    for (const uint32_t i : bodies.PushedBy(k)) {
      Vector3d v = ToVector3d(state.velocities[i]);
      bodies.Correct(k, ParticleOf(context, i), ToVector3d(state.positions[i]), v);
      state.velocities[i] = ToVec4(v);
      PassOn(context, k, i);
    }
  }
  bodies.CorrectColliders();
}

}  // namespace drape::cpu
