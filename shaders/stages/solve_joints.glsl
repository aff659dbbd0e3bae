// Stage `solve_joints`. Needs the accessors of one plan.
#include "lib/joint.glsl"
#include "lib/vector.glsl"
#include "stages/impulses.glsl"

#ifdef HAS_SOLVE_JOINTS

// Point joint k. The colours of the joints give each free particle one writer; pins are only read.
void SolveJoint(uint k, bool is_first_sweep) {
  uvec2 pair = uvec2(models[cloth.model.joint_pairs + 2u * k], models[cloth.model.joint_pairs + 2u * k + 1u]);
  float compliance = 0.0;
  vec3 lambda = vec3(0.0);
#ifdef HAS_GRIPS
  if (InverseMass(pair.x) == 0.0 && InverseMass(pair.y) == 0.0) return;
#endif
#ifdef HAS_JOINT_COMPLIANCE
  compliance = ModelFloat(cloth.model.joint_compliances + k);
  if (is_first_sweep) {
    SetScratchVector(cloth.scratch.joint_lambdas + 3u * k, lambda);
  } else {
    lambda = ScratchVector(cloth.scratch.joint_lambdas + 3u * k);
  }
#endif
  vec3 velocity_i = Velocity(pair.x);
  vec3 velocity_j = Velocity(pair.y);
  precise vec3 position_difference = Position(pair.y) - Position(pair.x);
  precise vec3 velocity_difference = velocity_j - velocity_i;
  vec3 difference = AddScaled(position_difference, cloth.step.h, velocity_difference);
  vec3 residual = JointResidual(difference, compliance, cloth.step.inverse_h, lambda);
#ifdef HAS_TOLERANCE
  if (!(Length(residual) > cloth.step.contact_tolerance)) return;
  MarkChanged();
#endif
  float inverse_mass_i = InverseMass(pair.x);
  float inverse_mass_j = InverseMass(pair.y);
  precise float inverse_mass_sum = inverse_mass_i + inverse_mass_j;
  vec3 impulse = JointImpulse(residual, cloth.step.inverse_h, inverse_mass_sum, compliance);
#ifdef HAS_JOINT_COMPLIANCE
  SetScratchVector(cloth.scratch.joint_lambdas + 3u * k, AddScaled(lambda, 1.0, impulse));
#endif
#ifdef HAS_IMPULSES
  if (PullsOnHeld(inverse_mass_i, inverse_mass_j)) PullAtJoint(k, impulse);
#endif
  if (inverse_mass_i != 0.0) SetVelocity(pair.x, AddScaled(velocity_i, -inverse_mass_i, impulse));
  if (inverse_mass_j != 0.0) SetVelocity(pair.y, AddScaled(velocity_j, inverse_mass_j, impulse));
}
#endif
