// From descriptions back to drape.v1.ClothSpec, so that CheckSpec gives the same bits again. Pure.
#pragma once

#include "drape/v1/cloth_spec.pb.h"
#include "server/session/cloth_record.h"

namespace drape::api {

// Topology, material of the constraints, mesh_import and pinned particles (without targets); not
// the lengths that are let out.
v1::ClothSpec ModelToSpec(const ModelDescription& description);
// Everything else: transform, environment, surface, pins with targets, settings, grips. The meshes
// of colliders leave out their arrays.
v1::ClothSpec ClothToSpec(const ClothDescription& description, const RigidTransform& transform);

}  // namespace drape::api
