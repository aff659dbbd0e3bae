#include "server/api/spec_message.h"

#include <algorithm>
#include <string>
#include <variant>

#include "server/api/geometry_message.h"
#include "server/api/mapping.h"
#include "server/api/settings_message.h"
#include "server/api/topology_message.h"
#include "server/scene/structural_fields.h"
#include "server/solver/surface_fields.h"

namespace drape::api {
namespace {

void SetNumber(std::string_view name, double value, v1::Material* material) {
  const auto* field = material->GetDescriptor()->FindFieldByName(std::string(name));
  DRAPE_CHECK(field != nullptr, "every number of a material is a field of the protocol");
  material->GetReflection()->SetDouble(material, field, value);
}

void Fill(const GridTopology& grid, v1::ClothSpec& spec) {
  v1::Grid& message = *spec.mutable_grid();
  message.set_columns(grid.columns);
  message.set_rows(grid.rows);
  message.set_width_m(grid.width_m);
  message.set_height_m(grid.height_m);
}

void Fill(const TriangleMesh& mesh, v1::ClothSpec& spec) {
  *spec.mutable_mesh() = MeshMessage(mesh);
}

v1::DistanceConstraint::Kind KindOf(ConstraintKind kind) {
  if (kind == ConstraintKind::kAtMost) return v1::DistanceConstraint::AT_MOST;
  if (kind == ConstraintKind::kAtLeast) return v1::DistanceConstraint::AT_LEAST;
  return v1::DistanceConstraint::EQUAL;
}

void Fill(const ParticleTopology& particles, v1::ClothSpec& spec) {
  v1::Particles& message = *spec.mutable_particles();
  for (const Eigen::Vector3d& p : particles.positions_m) Append(p, message.mutable_positions_m());
  message.mutable_masses_kg()->Add(particles.masses_kg.begin(), particles.masses_kg.end());
  for (const DistanceConstraint& constraint : particles.distance_constraints) {
    v1::DistanceConstraint& entry = *message.add_distance_constraints();
    entry.set_i(constraint.i);
    entry.set_j(constraint.j);
    entry.set_rest_length_m(constraint.rest_length_m);
    entry.set_compliance_m_per_n(constraint.compliance_m_per_n);
    entry.set_kind(KindOf(constraint.kind));
  }
  for (const Spring& spring : particles.springs) {
    v1::Spring& entry = *message.add_springs();
    entry.set_i(spring.i);
    entry.set_j(spring.j);
    entry.set_rest_length_m(spring.rest_length_m);
    entry.set_stiffness_n_per_m(spring.stiffness_n_per_m);
    entry.set_damping_n_s_per_m(spring.damping_n_s_per_m);
  }
  for (const PointJoint& joint : particles.point_joints) {
    v1::PointJoint& entry = *message.add_point_joints();
    entry.set_i(joint.i);
    entry.set_j(joint.j);
    entry.set_compliance_m_per_n(joint.compliance_m_per_n);
  }
}

v1::SelfCollision SelfCollisionMessage(const SelfCollision& self) {
  v1::SelfCollision message;
  if (self.thickness_m) message.set_thickness_m(*self.thickness_m);
  if (self.friction_static) message.set_friction_static(*self.friction_static);
  if (self.friction_dynamic) message.set_friction_dynamic(*self.friction_dynamic);
  return message;
}

// Of several described pins of one particle each gets the target that the cloth has.
void AddPins(const ClothDescription& description, v1::ClothSpec& spec) {
  for (const uint32_t described : description.model_description->pinned_particles) {
    v1::Pin& message = *spec.add_pins();
    message.set_particle(described);
    const uint32_t particle = description.model->ParticleOf(described);
    const auto pin = std::ranges::lower_bound(description.pins, particle, {}, &Pin::particle);
    DRAPE_CHECK(pin != description.pins.end() && pin->particle == particle,
                "the pins are those of the model");
    if (pin->target_m) Append(*pin->target_m, message.mutable_target_m());
  }
}

}  // namespace

v1::ClothSpec ModelToSpec(const ModelDescription& description) {
  v1::ClothSpec spec;
  std::visit([&](const auto& topology) { Fill(topology, spec); }, description.topology);
  for (const StructuralField& field : kStructuralFields) {
    if (!Has(description.topology, field)) continue;
    SetNumber(field.name, description.material.*field.member, spec.mutable_material());
  }
  if (description.mesh_import != MeshImport{}) {
    spec.mutable_mesh_import()->set_as_drawn(description.mesh_import.as_drawn);
    spec.mutable_mesh_import()->set_keep_lengths(description.mesh_import.keep_lengths);
    Append(description.mesh_import.warp_direction,
           spec.mutable_mesh_import()->mutable_warp_direction());
  }
  for (const uint32_t particle : description.pinned_particles) {
    spec.add_pins()->set_particle(particle);
  }
  return spec;
}

v1::ClothSpec ClothToSpec(const ClothDescription& description, const RigidTransform& transform) {
  const ClothParameters& parameters = description.parameters;
  v1::ClothSpec spec;
  *spec.mutable_transform() = ToProto(transform);
  for (const SurfaceField& field : kSurfaceFields) {
    SetNumber(field.name, parameters.*field.member, spec.mutable_material());
  }
  AddPins(description, spec);
  *spec.mutable_environment() = EnvironmentToProto(parameters);
  *spec.mutable_settings() = ToProto(parameters.settings);
  spec.set_max_grips(parameters.max_grips);
  if (parameters.self_collision)
    *spec.mutable_self_collision() = SelfCollisionMessage(*parameters.self_collision);
  return spec;
}

}  // namespace drape::api
