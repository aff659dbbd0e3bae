// Distance maps of the mesh colliders of a request: from packed arrays to shared maps.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/build_queue.h"
#include "server/api/field_checks.h"
#include "server/scene/colliders.h"
#include "server/session/distance_map_cache.h"

namespace drape::api {

// A mesh among the colliders of a request.
struct ColliderMesh {
  size_t collider = 0;  // its index
  TriangleMesh mesh;
};

// The meshes of a list that CheckColliders has passed.
std::vector<ColliderMesh> ReadColliderMeshes(
    const google::protobuf::RepeatedPtrField<v1::Collider>& colliders);

// The map of one ColliderMesh.
struct ColliderMap {
  size_t collider = 0;
  std::shared_ptr<const DistanceMap> map;
};

// Seconds of work: builder threads. INVALID_ARGUMENT with fields below `path`, that of the list
// ("spec.environment.colliders[2].mesh.triangles[7]"), of the first mesh that is no solid.
// `interruption`: asked now and then; null: nobody is.
Result<std::vector<ColliderMap>> BuildColliderMaps(const FieldPath& path,
                                                   std::span<const ColliderMesh> meshes,
                                                   const ClosedMeshLimits& limits,
                                                   Interruption* interruption,
                                                   DistanceMapCache& cache);

// Gives the mesh colliders their distance maps, and bodies among them the pivots of their motions,
// which are known now.
void SetMaps(std::span<const ColliderMap> maps, std::vector<Collider>& colliders,
             std::vector<RigidMotion>& motions);

}  // namespace drape::api
