#include "server/api/collider_maps.h"

#include <utility>
#include <variant>

#include "server/api/topology_validation.h"
#include "server/scene/body_mass.h"

namespace drape::api {

std::vector<ColliderMesh> ReadColliderMeshes(
    const google::protobuf::RepeatedPtrField<v1::Collider>& colliders) {
  std::vector<ColliderMesh> meshes;
  for (int k = 0; k < colliders.size(); ++k) {
    if (!colliders[k].has_mesh()) continue;
    meshes.push_back({static_cast<size_t>(k), ToTriangleMesh(colliders[k].mesh())});
  }
  return meshes;
}

Result<std::vector<ColliderMap>> BuildColliderMaps(const FieldPath& path,
                                                   std::span<const ColliderMesh> meshes,
                                                   const ClosedMeshLimits& limits,
                                                   Interruption* interruption,
                                                   DistanceMapCache& cache) {
  std::vector<ColliderMap> maps;
  for (const ColliderMesh& mesh : meshes) {
    Result<std::shared_ptr<const DistanceMap>> map = cache.Get(mesh.mesh, limits, interruption);
    if (!map.ok()) return Below(path.At(mesh.collider), map.status());
    maps.push_back({mesh.collider, std::move(map).value()});
  }
  return maps;
}

void SetMaps(std::span<const ColliderMap> maps, std::vector<Collider>& colliders,
             std::vector<RigidMotion>& motions) {
  for (const ColliderMap& map : maps) {
    Collider& collider = colliders[map.collider];
    std::get<DistanceMapShape>(collider.shape).map = map.map;
    if (!collider.is_body() || map.collider >= motions.size()) continue;
    RigidMotion& motion = motions[map.collider];
    motion.pivot_m = motion.position_m = CentreOfMass(collider);
  }
}

}  // namespace drape::api
