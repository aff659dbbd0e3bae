// drape.v1.Material, field by field by the names of kStructuralFields and kSurfaceFields.
#pragma once

#include <string_view>

#include "drape/v1/cloth_spec.pb.h"
#include "drape/v1/cloths.pb.h"
#include "server/core/violations.h"
#include "server/scene/structural_fields.h"
#include "server/solver/surface_fields.h"

namespace drape::api {

// The number that `message`, a Material or a ClothOverride, has in this field; unset = 0.
double NumberOf(const google::protobuf::Message& message, std::string_view name);

// The ranges are drape::CheckDescription's.
StructuralMaterial ReadStructuralMaterial(const v1::Material& material);
// The numbers of kSurfaceFields into `parameters`.
void CheckSurfaceMaterial(const FieldPath& path, const v1::Material& material,
                          ClothParameters& parameters, Violations& violations);
// Those that an override sets; the others stay.
void CheckSurfaceOverride(const FieldPath& path, const v1::ClothOverride& override_,
                          ClothParameters& parameters, Violations& violations);

}  // namespace drape::api
