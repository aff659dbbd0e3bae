// The fields of StructuralMaterial as a table: checks, messages and changes of cloths iterate over
// it.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "server/core/violations.h"
#include "server/scene/description.h"
#include "server/scene/description_checks.h"

namespace drape {

struct StructuralField {
  std::string_view name;  // of the field of drape.v1.Material
  double StructuralMaterial::*member;
  Range range;
  bool is_of_meshes = true;  // and of grids, which have all fields
  bool may_change = true;    // while the cloth runs
  // Whether a description that does not have this field must leave it 0.
  bool is_refused_elsewhere = false;
};

inline constexpr std::array kStructuralFields{
    StructuralField{.name = "areal_density_kg_per_m2",
                    .member = &StructuralMaterial::areal_density_kg_per_m2,
                    .range = Positive(kMaxCoefficient, "kg/m^2"),
                    .may_change = false},
    StructuralField{.name = "stretch_compliance_m_per_n",
                    .member = &StructuralMaterial::stretch_compliance_m_per_n,
                    .range = {0, kMaxCoefficient, "m/N"}},
    StructuralField{.name = "stretch_stiffness_n_per_m",
                    .member = &StructuralMaterial::stretch_stiffness_n_per_m,
                    .range = {0, kMaxCoefficient, "N/m"},
                    .is_refused_elsewhere = true},
    StructuralField{.name = "bending_stiffness_n_per_m",
                    .member = &StructuralMaterial::bending_stiffness_n_per_m,
                    .range = {0, kMaxCoefficient, "N/m"}},
    StructuralField{.name = "bending_rigidity_n_m",
                    .member = &StructuralMaterial::bending_rigidity_n_m,
                    .range = {0, kMaxBendingRigidity_n_m, "N m"},
                    .is_refused_elsewhere = true},
    StructuralField{.name = "shear_stiffness_n_per_m",
                    .member = &StructuralMaterial::shear_stiffness_n_per_m,
                    .range = {0, kMaxCoefficient, "N/m"},
                    .is_of_meshes = false},
    StructuralField{.name = "shear_modulus_n_per_m",
                    .member = &StructuralMaterial::shear_modulus_n_per_m,
                    .range = {0, kMaxCoefficient, "N/m"},
                    .is_refused_elsewhere = true},
};

// Whether cloths of this topology have the field.
inline bool Has(const Topology& topology, const StructuralField& field) {
  return std::holds_alternative<GridTopology>(topology) ||
         (field.is_of_meshes && std::holds_alternative<TriangleMesh>(topology));
}
constexpr std::string_view OwnersOf(const StructuralField& field) {
  return field.is_of_meshes ? "grids and meshes" : "grids";
}

}  // namespace drape
