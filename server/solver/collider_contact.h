// Which colliders the insides of edges and triangles touch (method.md, "Edges and triangles").
// Pure.
#pragma once

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// Whether a held particle that goes from one place to the other within a step pulls its cloth.
bool Pulls(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double time_step_s);

// The edges of a cloth in one step.
struct EdgesOfStep {
  ColliderContact contact = ColliderContact::kSurface;
  double length_m = 0;     // of a typical one (SceneModel::length_scale_m)
  bool is_pulled = false;  // some held particle pulls
};

// In a step at whose start the collider moves so; null: it rests as described.
bool TouchesEdges(const EdgesOfStep& edges, const Collider& collider, const RigidMotion* motion);

// Whether any collider may, in some step, however those move that may, and whatever is held.
bool HasSurfaceContacts(const SceneModel& model, const ClothParameters& parameters);
// The same of cloths whose colliders rest, once they have begun to move.
bool MayHaveSurfaceContacts(const SceneModel& model, const ClothParameters& parameters);
// The same for steps in which nothing pulls.
bool HasSurfaceContactsUnpulled(const SceneModel& model, const ClothParameters& parameters);

}  // namespace drape
