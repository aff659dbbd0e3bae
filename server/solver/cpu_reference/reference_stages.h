// The stages of a substep in their order, each in a file of its own (server/solver/method.md). A
// stage returns at once if it has nothing to do. Those of contacts of cloths with themselves and
// each other are methods of ReferenceSelfContacts.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "server/solver/cpu_reference/reference_contact.h"
#include "server/solver/cpu_reference/reference_context.h"

namespace drape::reference {

// Of each particle and collider.
template <class T>
void FillForContacts(const StepContext& context, const T& value, std::vector<T>& list) {
  list.clear();
  ResizeInPieces(
      list, context.model.particle_count() * context.colliders.size(),
      [&] { Ask(context.interruption); }, value);
}

// Change the velocities [m/s] by what acts for `duration_s` at these positions [m].
void ApplySprings(const StepContext& context, double duration_s,
                  const std::vector<Eigen::Vector3d>& positions,
                  std::vector<Eigen::Vector3d>& velocities);
void ApplyElastic(const StepContext& context, double duration_s,
                  const std::vector<Eigen::Vector3d>& positions,
                  std::vector<Eigen::Vector3d>& velocities);
void ApplyWind(const StepContext& context, double duration_s,
               const std::vector<Eigen::Vector3d>& positions,
               std::vector<Eigen::Vector3d>& velocities);

// The speeds with which particles leave the colliders that they hit in this substep.
void PredictContacts(StepContext& context);
// Gravity, and the springs that act within the substep.
void AccelerateBySprings(StepContext& context);
// The places and velocities with which the particles would end the substep without constraints.
void Predict(StepContext& context);
void SolveElastic(StepContext& context);
void SolveHinges(StepContext& context);
void DampTwist(StepContext& context);
void Tether(StepContext& context);

// One sweep each, over a range of strips, of constraints, of particles where there is one: one
// after the other they are the whole. They return whether an error was larger than the tolerance.
bool SolveStrips(StepContext& context, uint32_t begin, uint32_t end);
bool SolveDistance(StepContext& context, uint32_t begin, uint32_t end);
bool SolveJoints(StepContext& context);
bool SolveContacts(StepContext& context, uint32_t begin, uint32_t end);
void Refine(StepContext& context);

void Integrate(StepContext& context);
// One sweep each over the velocities that rigid constraints forbid.
void SolveDistanceVelocities(StepContext& context, uint32_t begin, uint32_t end);
void SolveJointVelocities(StepContext& context);
void CorrectVelocity(StepContext& context);

// The parts of predict, solve_contacts, integrate and correct_velocity for bodies.
void BeginBodies(StepContext& context, double begin_s);
void PredictBodies(StepContext& context);
bool SolveBodies(StepContext& context);
void IntegrateBodies(StepContext& context);
void CorrectBodies(StepContext& context);

// The errors that the sweeps remove; the residual is their largest.
// C + (alpha/h) lambda of a constraint that has this length [m].
double DistanceError(const StepContext& context, uint32_t index, double length);
// The same of a joint, with C = p_j - p_i at the end of the substep [m].
Eigen::Vector3d JointError(const StepContext& context, uint32_t index);
// Collider c as particle i is predicted to meet it.
ReferenceContact PredictedContact(const StepContext& context, uint32_t i, size_t c);
// Smallest gap that the end of the substep may have [m]: 0, or less for what was deep inside
// before.
double ContactFloor(const StepContext& context, uint32_t i, size_t c);

// Largest error left after the sweeps [m].
double Residual(const StepContext& context);

}  // namespace drape::reference
