// Contacts of a group of cloths with resting colliders; what contacts.cpp does for one cloth.
// Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_CONTACTS_INL_H_
#endif

#include <array>

#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Signed distances from a collider and the outward normals there; the formulas of
// constraint_math.h.
struct ClothGap {
  ClothLanes gap;  // [m]
  ClothVectors normal;
};

ClothLanes Length(const ClothVectors& v) {
  return Sqrt(Dot(v, v));
}

// Along d, or along `otherwise` where d has no direction.
ClothGap GapAlong(const ClothVectors& d, const ClothVectors& otherwise, ClothLanes offset) {
  const ClothLanes distance = Length(d);
  const ClothMask is_short = distance < SplatCloths(kMinDirectionLength);
  return {distance - offset, Select(is_short, otherwise, d / distance)};
}

ClothGap CapsuleGap(const ClothVectors& q, const ClothCollider& capsule) {
  const ClothLanes zero = SplatCloths(0), one = SplatCloths(1);
  const ClothVectors& segment = capsule.vector;
  const ClothVectors from_a = q - capsule.point;
  const ClothLanes length_sq = Dot(segment, segment);
  const ClothLanes ratio = Dot(from_a, segment) / length_sq;
  const ClothLanes within = Select(ratio < zero, zero, Select(one < ratio, one, ratio));
  const ClothMask is_point = length_sq < SplatCloths(kMinDirectionLength * kMinDirectionLength);
  const ClothLanes along = Select(is_point, zero, within);
  return GapAlong(from_a - along * segment, capsule.axes[0], capsule.offset);
}

ClothGap BoxGap(const ClothVectors& q, const ClothCollider& box) {
  const ClothLanes zero = SplatCloths(0), one = SplatCloths(1);
  const ClothVectors d = q - box.point;
  const ClothLanes half_extents[3] = {box.vector.x, box.vector.y, box.vector.z};
  ClothVectors from_nearest{zero, zero, zero}, normal = from_nearest;
  ClothLanes face = zero, distance_sq = zero;
  ClothMask is_beyond_one, is_beyond_two;
  for (size_t k = 0; k < 3; ++k) {
    const ClothLanes local = Dot(d, box.axes[k]);
    const ClothLanes side = Select(local < zero, -one, one);
    const ClothLanes beyond = Abs(local) - half_extents[k];
    const ClothLanes outside = Max(zero, beyond);
    from_nearest = from_nearest + (side * outside) * box.axes[k];
    distance_sq = distance_sq + outside * outside;
    const ClothMask is_beyond = beyond > zero;
    is_beyond_two |= is_beyond_one & is_beyond;
    is_beyond_one |= is_beyond;
    const ClothMask is_nearer = k == 0 ? zero < one : beyond > face;
    face = Select(is_nearer, beyond, face);
    normal = Select(is_nearer, side * box.axes[k], normal);
  }
  const ClothLanes distance = Sqrt(distance_sq);
  const ClothMask is_at_edge = AndNot(distance < SplatCloths(kMinDirectionLength), is_beyond_two);
  return {Select(is_at_edge, distance, face) - box.offset,
          Select(is_at_edge, from_nearest / distance, normal)};
}

ClothGap GapAt(const ClothVectors& q, const ClothCollider& collider) {
  switch (collider.kind) {
    case FloatCollider::Kind::kPlane:
      return {Dot(q - collider.point, collider.vector) - collider.offset, collider.vector};
    case FloatCollider::Kind::kCapsule:
      return CapsuleGap(q, collider);
    case FloatCollider::Kind::kBox:
      return BoxGap(q, collider);
    default:
      break;
  }
  const ClothLanes zero = SplatCloths(0);
  return GapAlong(q - collider.point, {zero, SplatCloths(1), zero}, collider.offset);
}

// How fast particles that hit are to leave [m/s] (ReboundSpeed).
ClothLanes ReboundSpeeds(const LaneContext& context, const ClothGap& at_start,
                         const ClothVectors& v) {
  const ClothLanes zero = SplatCloths(0);
  const ClothLanes approach = -Dot(v, at_start.normal);
  const ClothLanes gained =
      (SplatCloths(-2) * Dot(context.gravity, at_start.normal)) * Max(zero, at_start.gap);
  const ClothLanes speed = context.restitution * Sqrt(Max(zero, approach * approach + gained));
  return Select(approach > context.slowest_rebound, speed, zero);
}

// From positions and velocities before the substep.
void PredictContacts(const LaneContext& context) {
  const ClothLanes zero = SplatCloths(0);
  const ClothLanes depenetration = SplatCloths(context.controls.depenetration_distance);
  for (const uint32_t i : context.model.free_particles) {
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothGap gap = GapAt(context.particles[i].p, context.colliders[k]);
      ClothContact& contact = context.contacts[i * context.collider_count() + k];
      contact.tangent = {zero, zero, zero};
      contact.normal = zero;
      contact.floor = Min(gap.gap + depenetration, zero);
      contact.rebound =
          context.has_restitution ? ReboundSpeeds(context, gap, context.particles[i].u) : zero;
    }
  }
}

// Again where contacts let the substep end, after particles have been moved.
void FindContactFloors(const LaneContext& context) {
  const ClothLanes depenetration = SplatCloths(context.controls.depenetration_distance);
  for (const uint32_t i : context.model.free_particles) {
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothGap gap = GapAt(context.particles[i].p, context.colliders[k]);
      context.contacts[i * context.collider_count() + k].floor =
          Min(gap.gap + depenetration, SplatCloths(0));
    }
  }
}

// Friction of one particle against one collider. Returns the lanes that it changed beyond the
// tolerance.
ClothMask SolveFriction(const LaneContext& context, const ClothVectors& n, ClothMask is_active,
                        ClothContact& contact, ClothVectors& u) {
  const ClothVectors b = contact.tangent - (u - Dot(u, n) * n);
  const ClothLanes length = Length(b);
  const ClothLanes limit = context.friction_static * contact.normal;
  const ClothLanes scale = (context.friction_dynamic * contact.normal) / length;
  const ClothVectors tangent = Select(length > limit, scale * b, b);
  const ClothVectors change = tangent - contact.tangent;
  u = Select(is_active, u + change, u);
  contact.tangent = Select(is_active, tangent, contact.tangent);
  return is_active & (SplatCloths(context.controls.h) * Length(change) >
                      SplatCloths(context.controls.contact_tolerance));
}

// One particle against one collider. `after()` is called where it may have changed u.
template <class After>
ClothMask SolveContact(const LaneContext& context, const ClothCollider& collider,
                       const ClothVectors& p, ClothContact& contact, ClothVectors& u,
                       const After& after) {
  const FloatControls& controls = context.controls;
  const ClothLanes zero = SplatCloths(0);
  const ClothGap at_end = GapAt(p + u * controls.h, collider);
  const ClothLanes error = at_end.gap - contact.floor;
  const ClothLanes impulse = Max(zero, contact.normal - error * controls.inverse_h);
  if (!IsAnyLaneSet((impulse > zero) | (contact.normal > zero) |
                    (Dot(contact.tangent, contact.tangent) > zero))) {
    return {};
  }
  const ClothLanes change = impulse - contact.normal;
  u = Select(context.is_running, u + change * at_end.normal, u);
  contact.normal = Select(context.is_running, impulse, contact.normal);
  const ClothMask changed = context.is_running & (SplatCloths(controls.h) * Abs(change) >
                                                  SplatCloths(controls.contact_tolerance));
  const ClothMask has_friction =
      (context.friction_static > zero) &
      ((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
  const ClothMask slips =
      SolveFriction(context, at_end.normal, context.is_running & has_friction, contact, u);
  after();
  return changed | slips;
}

// One sweep. Returns the lanes in which an impulse was larger than the tolerance.
ClothMask SolveContacts(LaneContext& context) {
  ClothMask changed;
  const bool watches = context.reach.WatchesSweeps(context.max_iterations);
  if (context.collider_count() == 0 && !watches) return changed;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& particle = context.particles[i];
    ClothContact* const contacts = context.contacts + i * context.collider_count();
    const auto watch = [&] {
      if (!watches) return;
      context.is_held &= Holds(context.range, particle.p + particle.u * context.controls.h);
    };
    watch();
    for (size_t k = 0; k < context.collider_count(); ++k) {
      changed |=
          SolveContact(context, context.colliders[k], particle.p, contacts[k], particle.u, watch);
    }
  }
  return changed;
}

// No approach velocity, rebounds, Coulomb friction (VelocityAfterContact, VelocityAfterHit).
ClothVectors VelocityAfterContact(const LaneContext& context, const ClothContact& contact,
                                  const ClothVectors& n, const ClothVectors& v) {
  const ClothLanes zero = SplatCloths(0), one = SplatCloths(1);
  const ClothLanes normal_speed = Dot(v, n);
  const ClothLanes impulse = contact.rebound - normal_speed;
  const ClothVectors tangential = v - normal_speed * n;
  const ClothLanes speed = Length(tangential);
  const ClothMask slides = speed > context.friction_static * impulse;
  const ClothLanes keep = one - (context.friction_dynamic * impulse) / speed;
  const ClothVectors left = Select(slides, keep * tangential, {zero, zero, zero});
  const ClothMask is_hit = (contact.normal > zero) & (impulse > zero);
  return Select(is_hit, left + contact.rebound * n, v);
}

// Contacts; then damping.
void CorrectVelocity(const LaneContext& context) {
  if (context.substep.is_two_step) return;
  if (context.collider_count() == 0 && !context.has_damping) return;
  for (const uint32_t i : context.model.free_particles) {
    ClothParticle& particle = context.particles[i];
    ClothVectors v = particle.u;
    for (size_t k = 0; k < context.collider_count(); ++k) {
      const ClothContact& contact = context.contacts[i * context.collider_count() + k];
      if (!IsAnyLaneSet(contact.normal > SplatCloths(0))) continue;
      const ClothVectors n = GapAt(particle.p, context.colliders[k]).normal;
      v = VelocityAfterContact(context, contact, n, v);
    }
    particle.u = context.damping_factor * v;
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
