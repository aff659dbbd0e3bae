// From scene models to the message of their topology.
#pragma once

#include "drape/v1/simulation_service.pb.h"
#include "server/session/cloth_record.h"

namespace drape::api {

// [vertices, 3] and [triangles, 3].
v1::Mesh MeshMessage(const TriangleMesh& mesh);
v1::Topology TopologyOf(const ClothRecord& cloth);

}  // namespace drape::api
