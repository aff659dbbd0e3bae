// Validation of model descriptions: pure, before and after the particle system is built.
#pragma once

#include <string>
#include <vector>

#include "server/core/violations.h"
#include "server/scene/constraint_builder.h"
#include "server/scene/description.h"
#include "server/scene/scene_model.h"

namespace drape {

// Legal ranges of the numbers in a description. They are wide enough for any cloth in SI units and
// narrow enough that no product in a single-precision step leaves the range of a float.
inline constexpr double kMaxExtent_m = 1e6;       // |coordinate|, lengths
inline constexpr double kMinRestLength_m = 1e-9;  // of distance constraints
inline constexpr double kMinParticleMass_kg = 1e-12;
inline constexpr double kMaxParticleMass_kg = 1e12;
inline constexpr double kMaxCoefficient = 1e15;         // stiffness, damping, compliance; SI
inline constexpr double kMaxBendingRigidity_n_m = 1e6;  // of a steel plate of 4 cm

// Checks that need no built system: sizes, indices, finiteness, ranges, pins. Sizes come first and
// end the check, so that an absurd grid costs nothing. At most 16 violations; empty = good.
std::vector<FieldViolation> CheckDescription(const ModelDescription& description,
                                             const ModelLimits& limits);

// Positions that are finite and in range, corners that name existing vertices; the fields are
// "mesh.positions_m[3]" and "mesh.triangles[7]".
void CheckMeshValues(const TriangleMesh& mesh, Violations& violations);

// Edges that are let out, of a system with so many constraints: "let_out[3]".
std::vector<FieldViolation> CheckLetOut(const ModelDescription& description,
                                        size_t constraint_count);

// Checks that need the built system: a mesh without area, masses and rest lengths out of range, too
// many constraints or springs, in all or at one particle.
std::vector<FieldViolation> CheckParticleSystem(const ModelDescription& description,
                                                const ParticleSystem& system,
                                                const ModelLimits& limits);

}  // namespace drape
