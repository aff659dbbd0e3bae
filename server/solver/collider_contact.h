// Which colliders the insides of edges and triangles touch (method.md, "Edges and triangles").
// Pure.
#pragma once

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// Within a substep no particle is expected to go farther than this many times the way of the
// fastest one in the last substep, and what gravity adds [-]. Larger: more is looked at; smaller:
// what is thrown is found a substep late.
inline constexpr double kWayMargin = 2;
// Particles are followed on their way past a solid if they may go farther within a substep than
// this share of half of its smallest width [-]. Larger: what is pulled farther than expected gets
// across; smaller: time.
inline constexpr double kThinShare = 0.5;

// How far a particle of this speed may go in a substep of the step that begins.
double WayInSubstep_m(double speed_m_per_s, double gravity_m_per_s2, double time_step_s,
                      size_t substeps);

// Whether a held particle that goes from one place to the other within a step pulls its cloth.
bool Pulls(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double time_step_s);

// The edges of a cloth in one step.
struct EdgesOfStep {
  ColliderContact contact = ColliderContact::kSurface;
  double length_m = 0;     // of a typical one (SceneModel::length_scale_m)
  bool is_pulled = false;  // some held particle pulls
  double way_m = 0;        // WayInSubstep_m of the fastest particle
  double substep_s = 0;
};

// In a step at whose start the collider moves so; null: it rests as described.
bool TouchesEdges(const EdgesOfStep& edges, const Collider& collider, const RigidMotion* motion);

// Whether edges may touch any collider, in some step.
bool HasSurfaceContacts(const SceneModel& model, const ClothParameters& parameters);
// The same where nothing is thin for the speed of the cloth, whatever is held, and colliders move
// as they may move now.
bool HasSurfaceContactsPulled(const SceneModel& model, const ClothParameters& parameters);
// The same for steps in which nothing pulls.
bool HasSurfaceContactsUnpulled(const SceneModel& model, const ClothParameters& parameters);

}  // namespace drape
