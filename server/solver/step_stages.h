// The stages of a step, in order. One name each: the same word is the enum value, the kernel or
// GLSL library function, the function of each CPU backend, and the name of its test.
#pragma once

namespace drape {

// apply_springs     half a kick of the spring accelerations (HALF_KICKS only)
// apply_elastic     half a kick of the elements of bending and shear
// apply_wind        half a kick of the air's drag and lift on the triangles
// for each substep of size h:
//   predict         u = v + a h/2, the mean velocity over the substep; pins: (target - p) / h
//   damp_twist      every few substeps: the cells of a grid lose twist
//   tether          no particle farther from its pins than the cloth between them allows
//   until no error exceeds the tolerance, at most max_iterations times:
//     solve_strips    per phase of strips: the impulses that remove the errors of a whole path
//     refine          likewise, of the links that the strips have left far off and their neighbours
//     solve_distance  per colour: the impulse that removes each constraint's error at p + h u
//     solve_joints    per colour of the joints: likewise for point joints
//     solve_contacts  per particle: gap >= 0 at p + h u, Coulomb friction against h u
//   integrate       p += h u, v = u + a h/2
//   solve_velocity  per colour, velocity_iterations times: no velocity along rigid links and joints
//   correct_velocity  contacts: no approach velocity, Coulomb friction; then damping
//   apply_springs   a full kick, half a kick after the last substep
//   apply_elastic   likewise
//   apply_wind      likewise
// commit            the new state replaces the old one, unless the cloth is faulted
// measure           what a report asks for, from the committed state
enum class StepStage {
  kApplySprings,
  kApplyElastic,
  kApplyWind,
  kPredict,
  kDampTwist,
  kTether,
  kSolveStrips,
  kRefine,
  kSolveDistance,
  kSolveJoints,
  kSolveContacts,
  kIntegrate,
  kSolveVelocity,
  kCorrectVelocity,
  kCommit,
  kMeasure,
};

}  // namespace drape
