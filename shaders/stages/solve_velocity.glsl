// Stage `solve_velocity`. Needs the accessors of one plan.
#include "lib/distance.glsl"
#include "lib/joint.glsl"
#include "lib/velocity.glsl"
#include "stages/impulses.glsl"

// Removes the velocity along the rigid link k, after `integrate`. The colours give each free particle one writer;
// pins are only read.
void SolveLinkVelocity(uint k) {
#ifdef HAS_COMPLIANCE
  if (ModelFloat(cloth.model.compliances + k) > 0.0) return;
#endif
#ifdef HAS_INEQUALITIES
  if (models[cloth.model.kinds + k] != DRAPE_KIND_EQUAL) return;
#endif
  uvec2 pair = ConstraintPair(k);
  vec3 velocity_i = Velocity(pair.x);
  vec3 velocity_j = Velocity(pair.y);
  precise vec3 d = Position(pair.y) - Position(pair.x);
  precise vec3 velocity_difference = velocity_j - velocity_i;
  vec3 n = Direction(d, Length(d), vec3(1.0, 0.0, 0.0));
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  float impulse = VelocityImpulse(Dot(n, velocity_difference), inverse_mass_i, inverse_mass_j);
#ifdef HAS_IMPULSES
  precise vec3 pull = impulse * n;
  if (PullsOnHeld(inverse_mass_i, inverse_mass_j)) PullAtConstraint(k, pull);
#endif
  precise float change_i = -(inverse_mass_i * impulse);
  precise float change_j = inverse_mass_j * impulse;
  if (inverse_mass_i != 0.0) SetVelocity(pair.x, AddScaled(velocity_i, change_i, n));
  if (inverse_mass_j != 0.0) SetVelocity(pair.y, AddScaled(velocity_j, change_j, n));
}

#ifdef HAS_SOLVE_JOINTS
// Removes the relative velocity of the rigid joint k, along all three axes.
void SolveJointVelocity(uint k) {
#ifdef HAS_JOINT_COMPLIANCE
  if (ModelFloat(cloth.model.joint_compliances + k) > 0.0) return;
#endif
  uvec2 pair = uvec2(models[cloth.model.joint_pairs + 2u * k], models[cloth.model.joint_pairs + 2u * k + 1u]);
  vec3 velocity_i = Velocity(pair.x);
  vec3 velocity_j = Velocity(pair.y);
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
  precise vec3 impulse = (velocity_i - velocity_j) / inverse_mass_sum;
#ifdef HAS_IMPULSES
  if (PullsOnHeld(inverse_mass_i, inverse_mass_j)) PullAtJoint(k, impulse);
#endif
  if (inverse_mass_i != 0.0) SetVelocity(pair.x, AddScaled(velocity_i, -inverse_mass_i, impulse));
  if (inverse_mass_j != 0.0) SetVelocity(pair.y, AddScaled(velocity_j, inverse_mass_j, impulse));
}
#endif
