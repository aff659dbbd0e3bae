// drape.v1.Material, field by field by the names of kStructuralFields and kSurfaceFields.
#pragma once

#include <string_view>

#include "drape/v1/cloth_spec.pb.h"
#include "drape/v1/cloths.pb.h"
#include "server/core/violations.h"
#include "server/scene/structural_fields.h"
#include "server/session/cloth_record.h"
#include "server/solver/surface_fields.h"

namespace drape::api {

// The number in this field of `message`, a Material or a ClothOverride; 0 if it is not set.
double NumberOf(const google::protobuf::Message& message, std::string_view name);

// drape::CheckDescription checks the ranges.
StructuralMaterial ReadStructuralMaterial(const v1::Material& material);
// Whether the message says how far the cloth stretches, be it not at all.
bool HasStretch(const v1::Material& material);
// Reads the numbers of kSurfaceFields into `parameters`.
void CheckSurfaceMaterial(const FieldPath& path, const v1::Material& material,
                          ClothParameters& parameters, Violations& violations);
// Reads those that an override sets; the others stay.
void CheckSurfaceOverride(const FieldPath& path, const v1::ClothOverride& override_,
                          ClothParameters& parameters, Violations& violations);

// The numbers that an override sets, in no relation to those of a cloth.
NumberChanges<ClothParameters> ReadSurfaceOverride(const FieldPath& path,
                                                   const v1::ClothOverride& override_,
                                                   Violations& violations);

}  // namespace drape::api
