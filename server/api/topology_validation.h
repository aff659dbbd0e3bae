// From the topology of a drape.v1.ClothSpec to plain values. Pure.
#pragma once

#include <optional>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/description.h"

namespace drape::api {

// Checks only what is lost in plain values: that a topology is set, and the form of packed and flat
// arrays. Sizes, indices and numbers are drape::CheckDescription's. None where there is nothing to
// go on with. `path` leads to the spec.
std::optional<Topology> ReadTopology(const FieldPath& path, const v1::ClothSpec& spec,
                                     Violations& violations);

// Types, shapes and sizes of both arrays.
bool CheckMeshArrays(const FieldPath& path, const v1::Mesh& mesh, Violations& violations);
// A mesh that CheckMeshArrays has passed.
TriangleMesh ToTriangleMesh(const v1::Mesh& mesh);

// The lists of `particles`, which `path` leads to; a rest length that is unset is 0. Unknown kinds
// are added to `violations`, everything else is drape::CheckDescription's.
std::vector<DistanceConstraint> ReadConstraints(const FieldPath& path,
                                                const v1::Particles& particles,
                                                Violations& violations);
std::vector<Spring> ReadSprings(const v1::Particles& particles);
std::vector<PointJoint> ReadJoints(const v1::Particles& particles);

}  // namespace drape::api
