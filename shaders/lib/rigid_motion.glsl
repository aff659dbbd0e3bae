// Moving colliders: where a rigid body is some time after the start of the step, and how fast its points are
// (server/solver/method.md, «Moving colliders»; server/scene/rigid_motion.h).
#ifndef DRAPE_LIB_RIGID_MOTION_GLSL_
#define DRAPE_LIB_RIGID_MOTION_GLSL_

#include "lib/vector.glsl"

struct RigidMotion {
  vec3 pivot;             // as described [m]
  vec3 position;          // of the pivot at the start of the step [m]
  mat3 rotation;          // at the start of the step
  vec3 velocity;          // of the pivot [m/s]
  vec3 axis;              // of the turn, unit
  vec3 angular_velocity;  // [rad/s]
  float turns;            // per second [1/s]
  float chord_sine;       // sin(a)/a for the angle a of a substep
  float chord_cosine;     // h (1 - cos(a))/a^2 [s]
};

// The pose at time t: R(t) = turn by (sine, cosine) about the axis, after the rotation.
struct Pose {
  vec3 position;  // of the pivot [m]
  float sine;
  float cosine;
};

// Sine and cosine of a number of turns. Built-ins of drivers are off by more than single precision rounds.
vec2 SineCosine(float turns) {
  precise float part = turns - floor(turns);
  float quarter = floor(4.0 * part + 0.5);
  precise float x = (part - 0.25 * quarter) * 6.28318531;  // within pi/4 of 0
  precise float xx = x * x;
  precise float sine =
      x * (1.0 + xx * (-1.0 / 6.0 + xx * (1.0 / 120.0 + xx * (-1.0 / 5040.0 + xx / 362880.0))));
  precise float cosine =
      1.0 + xx * (-0.5 + xx * (1.0 / 24.0 + xx * (-1.0 / 720.0 + xx * (1.0 / 40320.0 -
                                                                       xx / 3628800.0))));
  if (quarter == 1.0) return vec2(cosine, -sine);
  if (quarter == 2.0) return vec2(-sine, -cosine);
  if (quarter == 3.0) return vec2(-cosine, sine);
  return vec2(sine, cosine);
}

vec3 CrossProduct(vec3 a, vec3 b) {
  precise vec3 product = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  return product;
}

// v turned about the unit axis (Rodrigues).
vec3 Turned(vec3 v, vec3 axis, float sine, float cosine) {
  float along = Dot(axis, v);
  vec3 across = CrossProduct(axis, v);
  precise vec3 turned = v * cosine + across * sine + axis * (along * (1.0 - cosine));
  return turned;
}

Pose PoseAt(RigidMotion motion, float seconds) {
  precise float turns = motion.turns * seconds;
  vec2 turn = SineCosine(turns);
  return Pose(AddScaled(motion.position, seconds, motion.velocity), turn.x, turn.y);
}

// The place of a point q in the description of the body, that is, before the body moved.
vec3 DescribedPoint(RigidMotion motion, Pose pose, vec3 q) {
  precise vec3 d = q - pose.position;
  vec3 before = Turned(d, motion.axis, -pose.sine, pose.cosine);
  precise vec3 described = motion.pivot + vec3(Dot(motion.rotation[0], before),
                                               Dot(motion.rotation[1], before),
                                               Dot(motion.rotation[2], before));
  return described;
}

// A direction of the body as described, turned as the body is.
vec3 PlacedDirection(RigidMotion motion, Pose pose, vec3 direction) {
  precise vec3 before = direction.x * motion.rotation[0] + direction.y * motion.rotation[1] +
                        direction.z * motion.rotation[2];
  return Turned(before, motion.axis, pose.sine, pose.cosine);
}

// Velocity [m/s] of the point of the body that is at `place`.
vec3 PointVelocity(RigidMotion motion, Pose pose, vec3 place) {
  precise vec3 r = place - pose.position;
  return AddScaled(motion.velocity, 1.0, CrossProduct(motion.angular_velocity, r));
}

// Over the substep, of the point that is at `place` when it starts [m/s].
vec3 MeanPointVelocity(RigidMotion motion, Pose pose, vec3 place) {
  precise vec3 r = place - pose.position;
  vec3 tangent = CrossProduct(motion.angular_velocity, r);
  vec3 inward = CrossProduct(motion.angular_velocity, tangent);
  precise vec3 velocity =
      motion.velocity + motion.chord_sine * tangent + motion.chord_cosine * inward;
  return velocity;
}

#endif
