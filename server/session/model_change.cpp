#include "server/session/model_change.h"

#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "server/core/violations.h"
#include "server/scene/constraint_builder.h"
#include "server/scene/structural_fields.h"

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

std::string_view KindOf(const Topology& topology) {
  if (std::holds_alternative<GridTopology>(topology)) return "a grid";
  if (std::holds_alternative<TriangleMesh>(topology)) return "a mesh";
  return "particles";
}

// Refuses changes that have no meaning for this topology.
Status CheckFits(const ModelChange& change, const Topology& topology) {
  const bool is_particles = std::holds_alternative<ParticleTopology>(topology);
  Violations violations;
  const auto require = [&](bool is_set, bool fits, const FieldPath& field, std::string_view owner) {
    violations.Require(!is_set || fits, field, [&] {
      return "belongs to " + std::string(owner) + "; one of the cloths is " +
             std::string(is_particles ? "made of " : "") + std::string(KindOf(topology));
    });
  };
  for (const StructuralField& field : kStructuralFields) {
    require(change.material.IsSet(field.member), Has(topology, field),
            FieldPath("spec").Child("material").Child(field.name), OwnersOf(field));
  }
  require(change.distance_constraints.has_value(), is_particles,
          "spec.particles.distance_constraints", "cloths made of particles");
  require(change.springs.has_value(), is_particles, "spec.particles.springs",
          "cloths made of particles");
  require(change.point_joints.has_value(), is_particles, "spec.particles.point_joints",
          "cloths made of particles");
  return violations.ToStatus();
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
  change.material.ApplyTo(description.material);
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

Result<ChangedModel> Build(const std::shared_ptr<const ModelDescription>& before,
                           const ClothChange& change, const ModelRules& rules,
                           const std::string& owner, ModelCache& models,
                           Interruption* interruption) {
  DRAPE_RETURN_IF_ERROR(CheckFits(change.model, before->topology));
  auto description = std::make_shared<ModelDescription>(*before);
  Apply(change.model, *description);
  if (change.pins) {
    description->pinned_particles.clear();
    for (const Pin& pin : *change.pins) description->pinned_particles.push_back(pin.particle);
  }
  auto model = SceneModel::Build(*description, LimitsFor(change, rules.limits), interruption);
  if (!model.ok()) return Below("spec", model.status());
  DRAPE_ASSIGN_OR_RETURN(SharedModel shared, models.Share(owner, *model, description));
  return ChangedModel{before, std::move(description), std::move(shared.model),
                      std::move(shared.charge)};
}

}  // namespace

Result<std::vector<ChangedModel>> BuildChangedModels(
    std::span<const std::shared_ptr<ClothRecord>> cloths, const ClothChange& change,
    const ModelRules& rules, const std::string& owner, ModelCache& models,
    Interruption* interruption) {
  std::map<std::shared_ptr<const ModelDescription>, ChangedModel> built;
  std::vector<ChangedModel> changed;
  for (const auto& cloth : cloths) {
    const auto before = cloth->description();
    ChangedModel& entry = built[before->model_description];
    if (entry.model == nullptr) {
      DRAPE_ASSIGN_OR_RETURN(
          entry, Build(before->model_description, change, rules, owner, models, interruption));
    }
    if (rules.accept) DRAPE_RETURN_IF_ERROR(rules.accept(*before, *entry.model));
    changed.push_back(entry);
  }
  return changed;
}

}  // namespace drape
