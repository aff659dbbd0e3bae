// From the topology of a drape.v1.ClothSpec to plain values. Pure.
#pragma once

#include <optional>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/description.h"

namespace drape::api {

// Checks only what plain values cannot show: that a topology is set, and the form of packed and
// flat arrays. drape::CheckDescription checks sizes, indices and numbers. None if the form leaves
// nothing to read. `path` leads to the spec.
std::optional<Topology> ReadTopology(const FieldPath& path, const v1::ClothSpec& spec,
                                     Violations& violations);

// Checks types, shapes and sizes of both arrays.
bool CheckMeshArrays(const FieldPath& path, const v1::Mesh& mesh, Violations& violations);
// A mesh that CheckMeshArrays has passed.
TriangleMesh ToTriangleMesh(const v1::Mesh& mesh);

// The lists of `particles`, which `path` leads to; an unset rest length is 0. Adds unknown kinds to
// `violations`; drape::CheckDescription checks everything else.
std::vector<DistanceConstraint> ReadConstraints(const FieldPath& path,
                                                const v1::Particles& particles,
                                                Violations& violations);
std::vector<Spring> ReadSprings(const v1::Particles& particles);
std::vector<PointJoint> ReadJoints(const v1::Particles& particles);

}  // namespace drape::api
