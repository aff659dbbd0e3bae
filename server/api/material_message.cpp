#include "server/api/material_message.h"

#include <string>

namespace drape::api {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

const FieldDescriptor* FieldOf(const Message& message, std::string_view name) {
  return message.GetDescriptor()->FindFieldByName(std::string(name));
}

// Requires dynamic <= static; adds nothing if one of them is out of its own range.
void CheckFrictionOrder(const FieldPath& path, const ClothParameters& parameters,
                        Violations& violations) {
  const Range legal{0, kMaxCoefficient};
  const double most = parameters.friction_static;
  const double dynamic = parameters.friction_dynamic;
  if (!legal.Contains(most) || !legal.Contains(dynamic)) return;
  violations.Require(dynamic <= most, path.Child("friction_dynamic"), [&] {
    return NumberText(dynamic) + " is not in [0, friction_static = " + NumberText(most) + "]";
  });
}

}  // namespace

double NumberOf(const Message& message, std::string_view name) {
  const FieldDescriptor* field = FieldOf(message, name);
  DRAPE_CHECK(field != nullptr, "every field of a material is one of the protocol");
  return message.GetReflection()->GetDouble(message, field);
}

StructuralMaterial ReadStructuralMaterial(const v1::Material& material) {
  StructuralMaterial result;
  for (const StructuralField& field : kStructuralFields) {
    const FieldDescriptor* descriptor = FieldOf(material, field.name);
    // A field with presence that is not set has a default other than 0.
    if (descriptor->has_presence() && !material.GetReflection()->HasField(material, descriptor)) {
      continue;
    }
    result.*field.member = NumberOf(material, field.name);
  }
  return result;
}

bool HasStretch(const v1::Material& material) {
  return material.has_stretch_compliance_m_per_n() || material.has_stretch_stiffness_n_per_m();
}

void CheckSurfaceMaterial(const FieldPath& path, const v1::Material& material,
                          ClothParameters& parameters, Violations& violations) {
  for (const SurfaceField& field : kSurfaceFields) {
    parameters.*field.member = NumberOf(material, field.name);
    violations.InRange(path.Child(field.name), parameters.*field.member, field.range);
  }
  CheckFrictionOrder(path, parameters, violations);
}

void CheckSurfaceOverride(const FieldPath& path, const v1::ClothOverride& override_,
                          ClothParameters& parameters, Violations& violations) {
  bool has_friction = false;
  for (const SurfaceField& field : kSurfaceFields) {
    const FieldDescriptor* descriptor = FieldOf(override_, field.name);
    if (!override_.GetReflection()->HasField(override_, descriptor)) continue;
    parameters.*field.member = NumberOf(override_, field.name);
    violations.InRange(path.Child(field.name), parameters.*field.member, field.range);
    has_friction |= field.name.starts_with("friction_");
  }
  if (has_friction) CheckFrictionOrder(path, parameters, violations);
}

NumberChanges<ClothParameters> ReadSurfaceOverride(const FieldPath& path,
                                                   const v1::ClothOverride& override_,
                                                   Violations& violations) {
  NumberChanges<ClothParameters> changes;
  for (const SurfaceField& field : kSurfaceFields) {
    const FieldDescriptor* descriptor = FieldOf(override_, field.name);
    if (!override_.GetReflection()->HasField(override_, descriptor)) continue;
    const double value = NumberOf(override_, field.name);
    violations.InRange(path.Child(field.name), value, field.range);
    changes.Set(field.member, value);
  }
  return changes;
}

}  // namespace drape::api
