// The data that the stages of one step work on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/bodies/bodies.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/cpu_reference/reference_cloth.h"
#include "server/solver/cpu_reference/reference_colliders.h"
#include "server/solver/cpu_reference/reference_constraints.h"
#include "server/solver/cpu_reference/reference_contact.h"
#include "server/solver/cpu_reference/reference_impulses.h"
#include "server/solver/cpu_reference/reference_step.h"
#include "server/solver/cpu_reference/reference_surface_contacts.h"
#include "server/solver/step_plan.h"

namespace drape::reference {

// One step of a cloth under way. Names as in server/solver/method.md. The cloth, the parameters and
// the plan must outlive it.
struct StepContext {
  // `parameters` are those of the cloth, or what its world makes of them.
  StepContext(const SteppedReference& stepped, const ClothParameters& its_parameters,
              const StepPlan& step_plan, uint32_t most_iterations, Interruption* its_interruption);

  // From particle i to j at the end of the substep, b + h u [m].
  Eigen::Vector3d PredictedDifference(uint32_t i, uint32_t j) const {
    return (base[j] - base[i]) + h * (u[j] - u[i]);
  }

  // Adds `factor` times the changes to the velocities of what is not held.
  void Add(const std::vector<Eigen::Vector3d>& changes, double factor,
           std::vector<Eigen::Vector3d>& velocities) const {
    for (size_t i = 0; i < changes.size(); ++i) {
      if (w[i] != 0) velocities[i] += factor * changes[i];
    }
  }
  // An impulse of the substep on particle i [N s], which only what is held passes on.
  void Pull(uint32_t i, const Eigen::Vector3d& impulse) const {
    if (impulses != nullptr && w[i] == 0) impulses->ToHeld(i, impulse);
  }
  // Of the impulses on all particles.
  void PullHeld(const std::vector<Eigen::Vector3d>& impulses_n_s, double factor = 1) const {
    for (const Grip& grip : held) Pull(grip.particle, factor * impulses_n_s[grip.particle]);
  }
  // Particle i as a body meets it, which starts the substep at `start_m`.
  bodies::Particle Particle(uint32_t i, const Eigen::Vector3d& start_m) const {
    return {i, start_m, w[i] != 0 ? model.masses_kg()[i] : std::numeric_limits<double>::infinity()};
  }
  // Whether nothing moves constraint or joint (i, j): both ends are held.
  bool IsHeld(uint32_t i, uint32_t j) const { return w[i] == 0 && w[j] == 0; }

  const SceneModel& model;
  const ClothParameters& parameters;
  const StepPlan& plan;
  const uint32_t max_iterations;
  Interruption* const interruption;  // of the whole step; null: nobody is asked
  const Eigen::Vector3d origin_m;    // of the cloth's frame in that of its world
  const std::vector<Grip> held;      // the pins and their targets, then the grips
  const std::vector<double> w;       // inverse masses [1/kg], 0 of what is held

  Substep substep;  // the one under way
  double h = 0;     // interval of its impulses [s]
  Bodies bodies;    // of the colliders
  ReferenceColliders colliders;
  ReferenceLengths rest_lengths;
  ParticleState state;                        // positions p and velocities v
  ParticleState previous;                     // p' and v', two steps only
  std::vector<Eigen::Vector3d> base;          // b, where the impulses start from [m]
  std::vector<Eigen::Vector3d> u;             // mean velocities over the interval [m/s]
  std::vector<Eigen::Vector3d> a;             // accelerations [m/s^2]
  std::vector<Eigen::Vector3d> hinge_a;       // of hinges, shared by substeps [m/s^2]
  std::vector<Eigen::Vector3d> hinge_forces;  // of them, with `impulses` [N]
  std::vector<double> lambda;                 // accumulated impulses, [constraint_count] [N s]
  std::vector<Eigen::Vector3d> joint_lambda;  // [joint_count] [N s]
  std::vector<ContactImpulse> beta;           // times w, [particle_count][collider_count] [m/s]
  std::unique_ptr<ImpulseSums> impulses;      // null: nobody asks for them
  std::vector<double> rebounds;               // [particle_count][collider_count] [m/s]; 0: no hit
  bool something_holds = false;               // some contact, by friction, in this substep
  ReferenceSurfaceContacts surface_contacts;  // of edges and triangles
};

}  // namespace drape::reference
