// Which colliders the insides of edges and triangles touch (method.md, "Edges and triangles").
// Pure.
#pragma once

#include "server/scene/colliders.h"
#include "server/scene/rigid_motion.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

// In a step at whose start it moves so; null: it rests as described. `edge_length_m`: of a typical
// edge (SceneModel::length_scale_m).
bool TouchesEdges(ColliderContact contact, const Collider& collider, const RigidMotion* motion,
                  double edge_length_m);

// Whether any collider may, in some step, however those move that may.
bool HasSurfaceContacts(const SceneModel& model, const ClothParameters& parameters);

}  // namespace drape
