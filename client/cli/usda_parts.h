// Names and prims of the cloths of a scene in USD.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/topology.h"
#include "drape/states.h"

namespace drape::cli {

// One USD prim: (part of) a cloth.
struct UsdaPart {
  size_t cloth = 0;                 // index in scene order
  std::string name;                 // of the prim; unique
  const char* type = "";            // "Mesh", "BasisCurves" or "Points"
  std::vector<uint32_t> particles;  // the particle of each point of the prim
  float radius_m = 0;               // its points are drawn this thick
  std::string attributes;           // lines of the prim that do not change with time
};

// A cloth with triangles is a Mesh, whose points are its particles. Lines are curves, whose points
// follow them (a particle where three lines meet is a point of several curves); particles in no
// line are points. Every particle is a point of some prim. `topologies`: one per cloth, or empty
// (points).
std::vector<UsdaPart> UsdaParts(const States& states, const std::vector<Topology>& topologies);

}  // namespace drape::cli
