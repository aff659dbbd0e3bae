#include "server/api/snapshot_reading.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/collider_maps.h"
#include "server/api/field_checks.h"
#include "server/api/geometry_message.h"
#include "server/api/sha256.h"
#include "server/api/snapshot_format.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_runtime.h"
#include "server/api/spec_validation.h"
#include "server/api/step_cost.h"
#include "server/api/topology_validation.h"
#include "server/session/cloth_creation.h"
#include "server/solver/solver_constants.h"

namespace drape::api {
namespace {

constexpr auto kFloats = {v1::PackedArray::FLOAT32, v1::PackedArray::FLOAT64};

Status CheckHeader(const v1::SnapshotHeader& header, const SnapshotTarget& target) {
  const auto refuse = [](const char* reason, const std::string& message) {
    return Status(StatusCode::kFailedPrecondition, reason, message);
  };
  if (header.version() > kSnapshotVersion) {
    return refuse("SNAPSHOT_TOO_NEW",
                  "the snapshot has format " + std::to_string(header.version()) +
                      ", written by version " + header.server_version() +
                      "; this server reads formats up to " + std::to_string(kSnapshotVersion));
  }
  if (header.version() == 0) return SnapshotDamaged("its header has no version");
  if (header.cloths() > target.limits.max_cloths_per_request) {
    return Status(StatusCode::kInvalidArgument, "INVALID_FIELDS",
                  "the snapshot has " + std::to_string(header.cloths()) + " cloths, at most " +
                      std::to_string(target.limits.max_cloths_per_request) + " are read at a time");
  }
  // Each is of some cloth.
  const uint64_t most_meshes =
      uint64_t{header.cloths()} * target.limits.max_mesh_colliders_per_cloth;
  if (header.models() > header.cloths() || header.meshes() > most_meshes) {
    return SnapshotDamaged("it has " + std::to_string(header.models()) + " models and " +
                           std::to_string(header.meshes()) + " meshes, more than its " +
                           std::to_string(header.cloths()) + " cloths could be made of");
  }
  if (target.is_inexact) return Status::Ok();
  const auto differs = [&](const char* what, const std::string& its, const std::string& ours) {
    return refuse("OTHER_BUILD", "the snapshot is of the " + std::string(what) + " " + its +
                                     ", this server has " + ours +
                                     ": its cloths would not go on with the same bits; with "
                                     "inexact they may go on with others");
  };
  if (header.backend() != target.backend.name) {
    return differs("backend", header.backend(), target.backend.name);
  }
  if (header.device() != target.backend.arithmetic) {
    return differs("device", header.device(), target.backend.arithmetic);
  }
  if (header.build_id() != BuildId()) return differs("build", header.build_id(), BuildId());
  return Status::Ok();
}

// A model that cloths of the snapshot share.
struct ReadModel {
  std::shared_ptr<const ModelDescription> description;
  std::shared_ptr<const SceneModel> model;
  std::shared_ptr<const void> charge;
};

// A distance map that they share.
struct ReadMap {
  std::shared_ptr<const DistanceMap> map;
  std::shared_ptr<const MapCharge> charge;
};

Result<ReadModel> ToModel(size_t number, const v1::ModelSnapshot& message,
                          const SnapshotTarget& target) {
  const FieldPath path = FieldPath("models").At(number);
  Violations violations;
  CheckedSpec checked = CheckSpec(path, message.spec(), target.limits, violations);
  violations.Length(path.Child("let_out_lengths_m"),
                    static_cast<size_t>(message.let_out_lengths_m_size()),
                    static_cast<size_t>(message.let_out_edges_size()), "one per edge");
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  for (int k = 0; k < message.let_out_edges_size(); ++k) {
    checked.description.let_out.push_back({message.let_out_edges(k), message.let_out_lengths_m(k)});
  }
  auto model = SceneModel::Build(checked.description, target.limits.model, target.interruption);
  if (!model.ok()) return Below(path, model.status());
  if (!target.is_inexact && (*model)->content_hash() != message.content_hash()) {
    return SnapshotDamaged("model " + std::to_string(number) + " is not the one that was saved");
  }
  auto description = std::make_shared<const ModelDescription>(std::move(checked.description));
  DRAPE_ASSIGN_OR_RETURN(SharedModel shared,
                         target.session.ShareModel(std::move(*model), description));
  return ReadModel{std::move(description), std::move(shared.model), std::move(shared.charge)};
}

Result<ReadMap> ToMap(size_t number, const v1::Mesh& message, const SnapshotTarget& target) {
  const FieldPath path = FieldPath("meshes").At(number);
  Violations violations;
  CheckMeshArrays(path, message, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  auto map = target.session.maps().Get(ToTriangleMesh(message), target.limits.collider_mesh,
                                       target.interruption);
  if (!map.ok()) return Below(path, map.status());
  DRAPE_ASSIGN_OR_RETURN(MapCharges charges, target.session.ChargeMaps({*map}));
  return ReadMap{std::move(*map), std::move(charges.at(0))};
}

// What cloths of the snapshot share.
struct ReadShared {
  std::vector<ReadModel> models;
  std::vector<ReadMap> maps;
};

// A mesh in place of those that a cloth leaves out: a tetrahedron.
const v1::Mesh& PlaceholderMesh() {
  static const v1::Mesh mesh = [] {
    v1::Mesh made;
    made.mutable_positions_m()->set_data_type(v1::PackedArray::FLOAT32);
    made.mutable_positions_m()->mutable_shape()->Add(4);
    made.mutable_positions_m()->mutable_shape()->Add(3);
    made.mutable_positions_m()->set_data(std::string(4 * 3 * sizeof(float), 0));
    made.mutable_triangles()->set_data_type(v1::PackedArray::UINT32);
    made.mutable_triangles()->mutable_shape()->Add(4);
    made.mutable_triangles()->mutable_shape()->Add(3);
    made.mutable_triangles()->set_data(std::string(4 * 3 * sizeof(uint32_t), 0));
    return made;
  }();
  return mesh;
}

// Of the colliders of `spec` the meshes, which get their maps in `parameters`. What those charge.
MapCharges SetMeshes(const FieldPath& path, const v1::ClothSnapshot& message,
                     const ReadShared& shared, ClothParameters& parameters,
                     Violations& violations) {
  std::vector<ColliderMap> maps;
  MapCharges charges;
  for (size_t k = 0; k < parameters.colliders.size(); ++k) {
    if (parameters.colliders[k].kind() != ShapeKind::kDistanceMap) continue;
    const auto number = static_cast<int>(maps.size());
    const bool is_known = number < message.collider_meshes_size() &&
                          message.collider_meshes(number) < shared.maps.size();
    if (!violations.Require(is_known, path.At(maps.size()),
                            [] { return "names no mesh of the snapshot"; })) {
      return charges;
    }
    const ReadMap& its = shared.maps[message.collider_meshes(number)];
    maps.push_back({k, its.map});
    charges.push_back(its.charge);
  }
  SetMaps(maps, parameters.colliders, parameters.collider_motions);
  return charges;
}

std::vector<Pin> CheckPins(const FieldPath& path, const v1::ClothSpec& spec, const ReadModel& model,
                           Violations& violations) {
  std::vector<Pin> pins = CheckPinTargets(path, spec.pins(), violations);
  const std::vector<uint32_t>& pinned = model.description->pinned_particles;
  if (!violations.Length(path, pins.size(), pinned.size(), "one per pin of the model")) return {};
  for (size_t k = 0; k < pins.size(); ++k) {
    violations.Require(pins[k].particle == pinned[k], path.At(k),
                       [] { return "is not the pin of the model"; });
  }
  return PinsOf(*model.model, std::move(pins));
}

// A column of the state. Every number within `most`, or it could not be of a cloth.
ScalarColumn CheckColumn(const FieldPath& path, const v1::PackedArray& array, size_t rows,
                         double most, Violations& violations) {
  const auto actual = CheckPackedRows(path, array, kFloats, 3, violations);
  if (!actual || !violations.Length(path, *actual, rows, "a row per particle")) return {};
  ScalarColumn column = ToColumn(array);
  const bool is_legal = std::visit(
      [&](const auto& values) {
        return std::ranges::all_of(values, [&](double value) { return std::abs(value) <= most; });
      },
      column);
  violations.Require(is_legal, path,
                     [&] { return "has a number that is not within " + NumberText(most); });
  return column;
}

std::shared_ptr<const ClearStart> CheckStart(const FieldPath& path,
                                             const v1::StartSnapshot& message,
                                             const ReadModel& model, Violations& violations) {
  auto start = std::make_shared<ClearStart>();
  start->clearance = StartClearance::kCaught;
  start->errors = {message.max_error(), message.rms_error()};
  start->let_out = model.description->let_out;
  start->largest_let_out = message.largest_let_out();
  if (!message.has_positions_m()) return start;
  start->clearance = StartClearance::kCleared;
  const size_t rows = model.model->particle_count();
  const ScalarColumn column = CheckColumn(path.Child("positions_m"), message.positions_m(), rows,
                                          kMaxCoordinate_m, violations);
  if (!violations.is_empty()) return start;
  for (size_t row = 0; row < rows; ++row) start->positions_m.push_back(VectorAt(column, row));
  return start;
}

Status CheckCost(const FieldPath& path, const SceneModel& model,
                 const ClothParameters& parameters) {
  return CheckStepCost(path.Child("settings").ToString(), model, parameters.settings,
                       parameters.colliders.size());
}

// The description and the place of a cloth.
void Describe(const FieldPath& path, v1::ClothSnapshot& message, const ReadShared& shared,
              const SnapshotTarget& target, SavedCloth& cloth, Violations& violations) {
  const ReadModel& model = shared.models[message.model()];
  for (v1::Collider& collider :
       *message.mutable_spec()->mutable_environment()->mutable_colliders()) {
    if (collider.has_mesh()) *collider.mutable_mesh() = PlaceholderMesh();
  }
  CheckedSpec checked;
  CheckClothPart(path, message.spec(), target.limits, checked, violations);
  checked.parameters.is_in_world = !cloth.world.empty();
  MapCharges charges =
      SetMeshes(path.Child("collider_meshes"), message, shared, checked.parameters, violations);
  violations.Require(!checked.parameters.self_collision || !model.model->triangles().empty(),
                     path.Child("self_collision"),
                     [] { return "belongs to cloths with triangles"; });
  auto pins = CheckPins(path.Child("pins"), message.spec(), model, violations);
  cloth.transform = checked.transform;
  cloth.placement.environment_origin_m =
      CheckPosition(path.Child("environment_origin_m"), message.environment_origin_m(), violations);
  cloth.placement.origin_in_environment_m = OriginInEnvironment(*model.model, cloth.transform);
  if (message.has_start()) {
    cloth.start = CheckStart(path.Child("start"), message.start(), model, violations);
  }
  cloth.description = std::make_shared<const ClothDescription>(ClothDescription{
      model.description, model.model, std::move(checked.parameters), std::move(pins), {}});
  cloth.charges = {std::move(charges), model.charge};
}

Result<SavedCloth> ToCloth(size_t number, v1::ClothSnapshot& message, const ReadShared& shared,
                           const SnapshotTarget& target) {
  const FieldPath path = FieldPath("cloths").At(number);
  Violations violations;
  if (!violations.Require(message.model() < shared.models.size(), path.Child("model"),
                          [] { return "names no model of the snapshot"; })) {
    return violations.ToStatus();
  }
  SavedCloth cloth{.id = ClothId::FromPacked(message.cloth_id())};
  cloth.world = CheckWorldName(path.Child("world"), message.world(), violations);
  Describe(path, message, shared, target, cloth, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  DRAPE_ASSIGN_OR_RETURN(cloth.collider_charge,
                         target.session.ChargeColliders(ColliderCountOf(*cloth.description)));
  const SceneModel& model = *cloth.description->model;
  DRAPE_RETURN_IF_ERROR(CheckCost(path, model, cloth.description->parameters));
  const uint32_t rows = model.particle_count();
  auto columns = std::make_shared<StateColumns>();
  columns->positions_m = CheckColumn(path.Child("positions_m"), message.positions_m(), rows,
                                     kMaxCoordinate_m, violations);
  columns->velocities_m_per_s =
      CheckColumn(path.Child("velocities_m_per_s"), message.velocities_m_per_s(), rows,
                  kMaxSpeed_m_per_s, violations);
  cloth.columns = std::move(columns);
  const ClothParameters on_device = OnDevice(model, cloth.description->parameters, cloth.placement);
  cloth.runtime = CheckRuntime(path.Child("runtime"), message.runtime(),
                               {model, on_device, target.backend.scalar}, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  return cloth;
}

// Which of `count` objects cloths name.
class NamedObjects {
 public:
  explicit NamedObjects(size_t count) : are_named_(count) {}
  void Name(uint32_t number) {
    if (number < are_named_.size()) are_named_[number] = true;
  }
  // INVALID_ARGUMENT for one that no cloth has named.
  Status Check(const FieldPath& path) const {
    const auto unnamed = std::ranges::find(are_named_, false);
    if (unnamed == are_named_.end()) return Status::Ok();
    const auto number = static_cast<size_t>(unnamed - are_named_.begin());
    return Status::InvalidField(path.At(number).ToString(), "is of no cloth of the snapshot");
  }

 private:
  std::vector<bool> are_named_;
};

}  // namespace

Result<std::vector<SavedCloth>> ReadSnapshot(std::string_view bytes, const SnapshotTarget& target) {
  SnapshotReader reader(bytes, target.limits.max_parsed_bytes());
  DRAPE_RETURN_IF_ERROR(reader.Begin());
  v1::SnapshotHeader header;
  DRAPE_RETURN_IF_ERROR(reader.Read(header));
  DRAPE_RETURN_IF_ERROR(CheckHeader(header, target));
  ReadShared shared;
  for (uint32_t k = 0; k < header.models(); ++k) {
    v1::ModelSnapshot message;
    Ask(target.interruption);
    DRAPE_RETURN_IF_ERROR(reader.Read(message));
    DRAPE_ASSIGN_OR_RETURN(ReadModel model, ToModel(k, message, target));
    shared.models.push_back(std::move(model));
  }
  for (uint32_t k = 0; k < header.meshes(); ++k) {
    v1::Mesh message;
    DRAPE_RETURN_IF_ERROR(reader.Read(message));
    DRAPE_ASSIGN_OR_RETURN(auto map, ToMap(k, message, target));
    shared.maps.push_back(std::move(map));
  }
  NamedObjects models(shared.models.size()), maps(shared.maps.size());
  std::vector<SavedCloth> cloths;
  for (uint32_t k = 0; k < header.cloths(); ++k) {
    v1::ClothSnapshot message;
    Ask(target.interruption);
    DRAPE_RETURN_IF_ERROR(reader.Read(message));
    DRAPE_ASSIGN_OR_RETURN(SavedCloth cloth, ToCloth(k, message, shared, target));
    models.Name(message.model());
    for (const uint32_t mesh : message.collider_meshes()) maps.Name(mesh);
    cloths.push_back(std::move(cloth));
  }
  DRAPE_RETURN_IF_ERROR(reader.End());
  DRAPE_RETURN_IF_ERROR(models.Check("models"));
  DRAPE_RETURN_IF_ERROR(maps.Check("meshes"));
  return cloths;
}

}  // namespace drape::api
