#include "server/api/snapshot_writing.h"

#include <unordered_map>
#include <vector>

#include "server/api/geometry_message.h"
#include "server/api/sha256.h"
#include "server/api/snapshot_format.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_runtime.h"
#include "server/api/spec_message.h"
#include "server/api/topology_message.h"
#include "server/scene/distance_map.h"

namespace drape::api {
namespace {

// Objects that cloths share, each once, in the order in which they are met.
template <class T>
class Numbered {
 public:
  uint32_t NumberOf(const T* object) {
    const auto [entry, is_new] =
        numbers_.try_emplace(object, static_cast<uint32_t>(objects_.size()));
    if (is_new) objects_.push_back(object);
    return entry->second;
  }
  const std::vector<const T*>& objects() const { return objects_; }

 private:
  std::unordered_map<const T*, uint32_t> numbers_;
  std::vector<const T*> objects_;
};

struct Shared {
  Numbered<ModelDescription> models;
  std::vector<const SceneModel*> built;  // [models]
  Numbered<DistanceMap> maps;
};

v1::ModelSnapshot MessageOf(const ModelDescription& description, const SceneModel& model) {
  v1::ModelSnapshot message;
  *message.mutable_spec() = ModelToSpec(description);
  for (const LetOutLink& link : description.let_out) {
    message.add_let_out_edges(link.constraint);
    message.add_let_out_lengths_m(link.rest_length_m);
  }
  message.set_content_hash(model.content_hash());
  return message;
}

v1::StartSnapshot MessageOf(const ClearStart& start) {
  v1::StartSnapshot message;
  if (start.clearance == StartClearance::kCleared) {
    std::vector<double> numbers;
    for (const Eigen::Vector3d& p : start.positions_m)
      numbers.insert(numbers.end(), p.begin(), p.end());
    FillColumn(numbers, 0, start.positions_m.size(), message.mutable_positions_m());
  }
  message.set_max_error(start.errors.max);
  message.set_rms_error(start.errors.rms);
  message.set_largest_let_out(start.largest_let_out);
  return message;
}

v1::ClothSnapshot MessageOf(const SavedCloth& cloth, Shared& shared) {
  const ClothDescription& description = *cloth.description;
  v1::ClothSnapshot message;
  message.set_cloth_id(cloth.id.Packed());
  message.set_world(cloth.world);
  message.set_model(shared.models.NumberOf(description.model_description.get()));
  *message.mutable_spec() = ClothToSpec(description, cloth.transform);
  for (const Collider& collider : description.parameters.colliders) {
    const auto map = MapOf(collider);
    if (map != nullptr) message.add_collider_meshes(shared.maps.NumberOf(map.get()));
  }
  Append(cloth.placement.environment_origin_m, message.mutable_environment_origin_m());
  if (cloth.start != nullptr) *message.mutable_start() = MessageOf(*cloth.start);
  const size_t particles = description.model->particle_count();
  FillColumn(cloth.columns->positions_m, cloth.first_row, particles, message.mutable_positions_m());
  FillColumn(cloth.columns->velocities_m_per_s, cloth.first_row, particles,
             message.mutable_velocities_m_per_s());
  *message.mutable_runtime() = RuntimeMessage(cloth.runtime);
  return message;
}

// Numbers everything that is shared.
void Meet(const SavedCloth& cloth, Shared& shared) {
  const ClothDescription& description = *cloth.description;
  if (shared.models.NumberOf(description.model_description.get()) == shared.built.size()) {
    shared.built.push_back(description.model.get());
  }
  for (const Collider& collider : description.parameters.colliders) {
    const auto map = MapOf(collider);
    if (map != nullptr) shared.maps.NumberOf(map.get());
  }
}

}  // namespace

Result<std::string> WriteSnapshot(const SavedStates& saved, const BackendDescription& backend,
                                  const std::string& version,
                                  const std::function<Status(uint64_t)>& count) {
  Shared shared;
  for (const SavedCloth& cloth : saved.cloths) Meet(cloth, shared);
  v1::SnapshotHeader header;
  header.set_version(kSnapshotVersion);
  header.set_server_version(version);
  header.set_build_id(BuildId());
  header.set_backend(backend.name);
  header.set_device(backend.arithmetic);
  header.set_models(static_cast<uint32_t>(shared.built.size()));
  header.set_meshes(static_cast<uint32_t>(shared.maps.objects().size()));
  header.set_cloths(static_cast<uint32_t>(saved.cloths.size()));
  SnapshotWriter writer(count);
  DRAPE_RETURN_IF_ERROR(writer.Add(header));
  for (size_t k = 0; k < shared.built.size(); ++k) {
    DRAPE_RETURN_IF_ERROR(writer.Add(MessageOf(*shared.models.objects()[k], *shared.built[k])));
  }
  for (const DistanceMap* map : shared.maps.objects()) {
    DRAPE_RETURN_IF_ERROR(writer.Add(MeshMessage(map->mesh())));
  }
  for (const SavedCloth& cloth : saved.cloths) {
    DRAPE_RETURN_IF_ERROR(writer.Add(MessageOf(cloth, shared)));
  }
  return writer.Take();
}

}  // namespace drape::api
