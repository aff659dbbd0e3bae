#include "server/solver/cpu/step/find_reach.h"

#include <algorithm>
#include <numeric>

#include "server/solver/collider_contact.h"
#include "server/solver/cpu/step/collider_gap.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

// Rounding of a gap, as a share of the lengths that it is computed from: each of its operations,
// fewer than 64, is off by at most 2^-24 of them.
constexpr float kGapRounding = 0x1p-18f;

// At first only every 16th particle is looked at: all of them take 3 % of the step of a cloth at
// rest on the ground.
constexpr size_t kSampleStride = 16;

// The collider, or where it is not convex the box around it. With the same gap or a smaller one
// wherever that is above 0.
FloatCollider ConvexBound(const FloatCollider& collider) {
  if (collider.kind != ShapeKind::kDistanceMap) return collider;
  FloatCollider box{
      ShapeKind::kBox, {collider.place.point, Vec4{}, collider.place.axes}, collider.offset};
  for (uint32_t k = 0; k < 3; ++k) {
    const auto cells = static_cast<float>(collider.samples.counts[k] - 1);
    box.place.vector[k] = cells * collider.samples.cell / 2;
    box.place.point += box.place.vector[k] * box.place.axes[k];
  }
  return box;
}

// The lengths that gaps in the box are computed from, added up [m].
float SizeOf(const FloatCollider& collider, const ParticleBox& box) {
  return Length(Max(Abs(box.low), Abs(box.high))) + Length(collider.place.point) +
         Length(collider.place.vector) + collider.offset;
}

// Whether all gaps to a convex surface in the box are larger than `way`. A convex body lies behind
// the plane through its point that is nearest to some x, across the line to x: so for every y in
// the box gap(y) >= gap(x) + (y - x).n. The next x is the point of the box that is nearest to that
// point, or rather to the one `offset` further inside (a sphere's centre, on a capsule's segment),
// which gets there sooner. May say no for the corners of boxes that are hardly apart.
template <class Surface>
bool IsApart(const Surface& surface, float offset, const ParticleBox& box, float way, float size) {
  Vec4 x = (box.low + box.high) / 2;
  for (uint32_t k = 0; k < kReachDirections; ++k) {
    const Gap at_x = surface.GapAtStart(x);
    if (!(at_x.gap > 0)) return false;
    const Vec4 nearest = at_x.normal < 0 ? box.high : box.low;
    const Vec4 farthest_from_x = Max(box.high - x, x - box.low);
    // The direction is rounded more where it comes from a small difference.
    const float rounding = kGapRounding * size * (1 + Length(farthest_from_x) / at_x.gap);
    if (at_x.gap + Dot(nearest - x, at_x.normal) > way + rounding) return true;
    x = Min(Max(x - (at_x.gap + offset) * at_x.normal, box.low), box.high);
  }
  return false;
}

// Whether a particle in `range` may touch collider k within the step.
bool MayMeet(const StepContext& context, size_t k, const ParticleBox& range) {
  const FloatCollider shape = ConvexBound(context.controls.colliders[k]);
  const float size = SizeOf(shape, range);
  if (context.collider_motions.empty())
    return !IsApart(RestingSurface(shape), shape.offset, range, 0, size);
  // Gaps change no faster than the body's points move that are where they are taken.
  const RigidMotion& motion = context.collider_motions[k];
  const Vec4 pivot = ToVec4(motion.position_m);
  const float duration = context.controls.time_step;
  const float way = Length(ToVec4(motion.velocity_m_per_s)) * duration;
  const float from_pivot = Length(Max(Abs(range.low - pivot), Abs(range.high - pivot))) + way;
  const float turn = Length(ToVec4(motion.angular_velocity_rad_per_s)) * duration;
  const float lengths = Length(pivot) + Length(ToVec4(motion.pivot_m)) + way;
  return !IsApart(MovingSurface(shape, motion), shape.offset, range, way + turn * from_pivot,
                  size + lengths);
}

// The range in which the free particles of a cloth in this state, every `stride`-th of them, are
// expected to stay within a step.
ParticleBox RangeOf(const StepContext& context, const FloatState& state, size_t stride) {
  const HeldParticles& held = context.held;
  const FloatControls& controls = context.controls;
  ParticleBox range;
  Vec4 speeds{}, pin_ways{};  // the largest along each axis
  for (size_t k = 0; k < held.free_particles.size(); k += stride) {
    const uint32_t i = held.free_particles[k];
    range.Add(state.positions[i]);
    speeds = Max(speeds, Abs(state.velocities[i]));
  }
  for (size_t k = 0; k < held.particles.size(); ++k) {
    pin_ways = Max(pin_ways, Abs(held.targets[k] - state.positions[held.particles[k]]));
  }
  // Edges and triangles are between all particles.
  for (size_t k = 0; controls.plan.solver.has_surface_contacts && k < held.particles.size(); ++k) {
    range.Add(state.positions[held.particles[k]]);
    range.Add(held.targets[k]);
  }
  const float duration = controls.time_step;
  const float way = (Length(speeds) + Length(controls.gravity) * duration) * duration;
  const float reach = static_cast<float>(kReachFactor) * (way + Length(pin_ways)) +
                      static_cast<float>(kReachMarginRatio) * context.model.length_scale;
  const Vec4 margin{reach, reach, reach, 0};
  return {range.low - margin, range.high + margin};
}

// Bodies are asked for by themselves (alone/bodies.h).
void AddAll(const StepContext& context, std::vector<uint32_t>& near) {
  near.resize(context.controls.colliders.size());
  std::iota(near.begin(), near.end(), 0u);
  std::erase_if(near, [&](uint32_t k) { return context.IsBody(k); });
}

size_t CountOfAll(const StepContext& context) {
  size_t count = context.controls.colliders.size();
  for (const Collider& collider : context.colliders) count -= collider.is_body() ? 1 : 0;
  return count;
}

// Adds the colliders that a particle in `range` may touch.
void AddNear(const StepContext& context, const ParticleBox& range, std::vector<uint32_t>& near) {
  const auto count = static_cast<uint32_t>(context.controls.colliders.size());
  for (uint32_t k = 0; k < count; ++k) {
    if (context.IsBody(k)) continue;
    const auto place = std::lower_bound(near.begin(), near.end(), k);
    if (place != near.end() && *place == k) continue;
    if (MayMeet(context, k, range)) near.insert(place, k);
  }
}

bool TouchesEdges(const StepContext& context, uint32_t collider) {
  const RigidMotion* const motion =
      context.collider_motions.empty() ? nullptr : &context.collider_motions[collider];
  return drape::TouchesEdges(context.edges, context.colliders[collider], motion);
}

}  // namespace

ParticleBox AddNear(const StepContext& context, const FloatState& state,
                    std::vector<uint32_t>& near) {
  const size_t count = CountOfAll(context);
  if (!context.leaves_out_colliders || count == 0) {
    AddAll(context, near);
    return {};
  }
  // Few particles tell of most colliders that they are near.
  AddNear(context, RangeOf(context, state, kSampleStride), near);
  if (near.size() == count) return {};
  const ParticleBox range = RangeOf(context, state, 1);
  AddNear(context, range, near);
  return range;
}

bool HasCollidersForEdges(const StepContext& context) {
  if (context.surface_parts == nullptr) return false;
  for (uint32_t k = 0; k < context.colliders.size(); ++k) {
    if (TouchesEdges(context, k)) return true;
  }
  return false;
}

bool MayTouchEdges(const StepContext& context, const FloatState& state) {
  if (!HasCollidersForEdges(context)) return false;
  std::vector<uint32_t> near;
  AddNear(context, state, near);
  return std::ranges::any_of(near, [&](uint32_t k) { return TouchesEdges(context, k); });
}

void FindReach(const StepContext& context, const FloatState& state, ColliderReach& reach) {
  reach.near.clear();
  reach.range = AddNear(context, state, reach.near);
  reach.has_far = reach.near.size() < CountOfAll(context);
  reach.has_left = false;
}

void ReachAll(const StepContext& context, ColliderReach& reach) {
  AddAll(context, reach.near);
  reach.has_far = reach.has_left = false;
}

}  // namespace drape::cpu
