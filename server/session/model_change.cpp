#include "server/session/model_change.h"

#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "server/scene/constraint_builder.h"

namespace drape {
namespace {

constexpr uint32_t kNoLimit = std::numeric_limits<uint32_t>::max();

// Any existing cloth can be repinned: its sizes were checked at creation and do not depend on the
// pins.
ModelLimits LimitsFor(const ClothChange& change, ModelLimits limits) {
  if (!change.model.is_any_set()) return {kNoLimit, kNoLimit, kNoLimit};
  limits.max_particles = kNoLimit;
  return limits;
}

// Field names as in UpdateClothsRequest: "pins[2].particle" -> "spec.pins[2].particle".
Status InSpec(const Status& status) {
  std::vector<FieldViolation> violations = status.violations();
  if (violations.empty()) return status;
  for (FieldViolation& violation : violations) violation.field = "spec." + violation.field;
  return Status::InvalidFields(std::move(violations));
}

std::string_view KindOf(const Topology& topology) {
  if (std::holds_alternative<GridTopology>(topology)) return "a grid";
  if (std::holds_alternative<TriangleMesh>(topology)) return "a mesh";
  return "particles";
}

// Refuses changes that have no meaning for this topology.
Status CheckFits(const ModelChange& change, const Topology& topology) {
  const bool is_grid = std::holds_alternative<GridTopology>(topology);
  const bool is_particles = std::holds_alternative<ParticleTopology>(topology);
  std::vector<FieldViolation> violations;
  const auto require = [&](bool is_set, bool fits, const char* field, const char* owner) {
    if (!is_set || fits) return;
    violations.push_back({field, "belongs to " + std::string(owner) + "; one of the cloths is " +
                                     std::string(is_particles ? "made of " : "") +
                                     std::string(KindOf(topology))});
  };
  require(change.stretch_compliance_m_per_n.has_value(), !is_particles,
          "spec.material.stretch_compliance_m_per_n", "grids and meshes");
  require(change.bending_stiffness_n_per_m.has_value(), !is_particles,
          "spec.material.bending_stiffness_n_per_m", "grids and meshes");
  require(change.shear_stiffness_n_per_m.has_value(), is_grid,
          "spec.material.shear_stiffness_n_per_m", "grids");
  require(change.bending_rigidity_n_m.has_value(), !is_particles,
          "spec.material.bending_rigidity_n_m", "grids and meshes");
  require(change.stretch_stiffness_n_per_m.has_value(), !is_particles,
          "spec.material.stretch_stiffness_n_per_m", "grids and meshes");
  require(change.shear_modulus_n_per_m.has_value(), is_grid, "spec.material.shear_modulus_n_per_m",
          "grids");
  require(change.distance_constraints.has_value(), is_particles,
          "spec.particles.distance_constraints", "cloths made of particles");
  require(change.springs.has_value(), is_particles, "spec.particles.springs",
          "cloths made of particles");
  require(change.point_joints.has_value(), is_particles, "spec.particles.point_joints",
          "cloths made of particles");
  return violations.empty() ? Status::Ok() : Status::InvalidFields(std::move(violations));
}

// `connections` with the distance in the rest shape where a rest length is not given.
template <class Connection>
std::vector<Connection> WithRestLengths(std::vector<Connection> connections,
                                        const std::vector<Eigen::Vector3d>& positions_m) {
  for (Connection& connection : connections) {
    if (connection.rest_length_m != kRestShapeLength) continue;
    connection.rest_length_m = RestDistance_m(connection.i, connection.j, positions_m);
  }
  return connections;
}

void Apply(const ModelChange& change, ModelDescription& description) {
  StructuralMaterial& material = description.material;
  material.stretch_compliance_m_per_n =
      change.stretch_compliance_m_per_n.value_or(material.stretch_compliance_m_per_n);
  material.bending_stiffness_n_per_m =
      change.bending_stiffness_n_per_m.value_or(material.bending_stiffness_n_per_m);
  material.shear_stiffness_n_per_m =
      change.shear_stiffness_n_per_m.value_or(material.shear_stiffness_n_per_m);
  material.bending_rigidity_n_m =
      change.bending_rigidity_n_m.value_or(material.bending_rigidity_n_m);
  material.stretch_stiffness_n_per_m =
      change.stretch_stiffness_n_per_m.value_or(material.stretch_stiffness_n_per_m);
  material.shear_modulus_n_per_m =
      change.shear_modulus_n_per_m.value_or(material.shear_modulus_n_per_m);
  auto* particles = std::get_if<ParticleTopology>(&description.topology);
  if (particles == nullptr) return;
  if (change.distance_constraints) {
    particles->distance_constraints =
        WithRestLengths(*change.distance_constraints, particles->positions_m);
  }
  if (change.springs) {
    particles->springs = WithRestLengths(*change.springs, particles->positions_m);
  }
  if (change.point_joints) particles->point_joints = *change.point_joints;
}

Result<ChangedModel> Build(const ModelDescription& before, const ClothChange& change,
                           const ModelRules& rules, ModelCache& models) {
  DRAPE_RETURN_IF_ERROR(CheckFits(change.model, before.topology));
  auto description = std::make_shared<ModelDescription>(before);
  Apply(change.model, *description);
  if (change.pins) {
    description->pinned_particles.clear();
    for (const Pin& pin : *change.pins) description->pinned_particles.push_back(pin.particle);
  }
  auto model = SceneModel::Build(*description, LimitsFor(change, rules.limits));
  if (!model.ok()) return InSpec(model.status());
  return ChangedModel{std::move(description), models.Share(*model), {}};
}

}  // namespace

Result<std::vector<ChangedModel>> BuildChangedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change,
    const ModelRules& rules, ModelCache& models) {
  std::map<std::shared_ptr<const ModelDescription>, ChangedModel> built;
  std::vector<ChangedModel> changed;
  for (const auto& cloth : cloths) {
    const auto before = cloth->description();
    ChangedModel& entry = built[before->model_description];
    if (entry.model == nullptr) {
      DRAPE_ASSIGN_OR_RETURN(entry, Build(*before->model_description, change, rules, models));
    }
    if (rules.accept) DRAPE_RETURN_IF_ERROR(rules.accept(*before, *entry.model));
    changed.push_back(entry);
  }
  return changed;
}

}  // namespace drape
