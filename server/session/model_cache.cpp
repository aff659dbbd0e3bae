#include "server/session/model_cache.h"

#include <algorithm>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace drape {

namespace {

// A backend has a model of its own, about as large.
constexpr uint64_t kCopies = 2;

// A driven rest length: its motion, its targets and its place, and two lengths of the backend.
constexpr uint64_t kBytesPerLength = 72;

// A collider: as described, as the backend has it, its motion and its targets. Measured on `cpu`
// and `reference`: 480 to 800 where it rests, 1500 to 1700 once one of its cloth has moved.
constexpr uint64_t kBytesPerCollider = 1792;

// Keeps what it counts alive, so that nothing else gets its address.
struct ObjectCharge {
  std::shared_ptr<const void> object;
  std::shared_ptr<void> bytes;
};

struct ModelCharge {
  std::shared_ptr<const void> model;
  std::shared_ptr<const void> description;
};

template <class... Lists>
uint64_t SizeOfLists_bytes(const Lists&... lists) {
  return (std::span(lists).size_bytes() + ...);
}

}  // namespace

uint64_t SizeOf_bytes(const SceneModel& model) {
  uint64_t bytes = sizeof(model);
  const auto add = [&bytes](const auto&... lists) { bytes += SizeOfLists_bytes(lists...); };
  add(model.rest_positions_m(), model.start_positions_m(), model.masses_kg(),
      model.inverse_masses_per_kg(), model.pins());
  add(model.constraints(), model.constraint_sources(), model.joints(), model.springs(),
      model.spring_offsets(), model.spring_ends());
  add(model.elastic_elements(), model.elastic_shares().offsets, model.elastic_shares().ends,
      model.elastic_lines().lines, model.elastic_lines().stiffnesses_n_per_m);
  add(model.tether_offsets(), model.tethers(), model.strips().strip_offsets,
      model.strips().constraints, model.strips().particles);
  add(model.triangles(), model.triangle_offsets(), model.particle_triangles(),
      model.triangle_masses_kg(), model.corner_shares());
  return bytes;
}

ModelCache::ModelCache(uint64_t max_bytes)
    : budget_("QUOTA_EXCEEDED", ByteBudget::Limit{"half of max_model_bytes", max_bytes / 2},
              ByteBudget::Limit{"max_model_bytes", max_bytes}, 0) {}

uint64_t SizeOf_bytes(const ModelDescription& description) {
  uint64_t bytes =
      sizeof(description) + SizeOfLists_bytes(description.pinned_particles, description.let_out);
  if (const auto* mesh = std::get_if<TriangleMesh>(&description.topology)) {
    bytes += SizeOfLists_bytes(mesh->positions_m, mesh->triangles);
  } else if (const auto* net = std::get_if<ParticleTopology>(&description.topology)) {
    bytes += SizeOfLists_bytes(net->positions_m, net->masses_kg, net->distance_constraints,
                               net->springs, net->point_joints);
  }
  return bytes;
}

Result<SharedModel> ModelCache::Share(const std::string& owner,
                                      std::shared_ptr<const SceneModel> model,
                                      std::shared_ptr<const ModelDescription> description) {
  SharedModel shared;
  shared.model = Find(std::move(model));
  DRAPE_ASSIGN_OR_RETURN(shared.charge,
                         Charge(owner, shared.model, kCopies * SizeOf_bytes(*shared.model)));
  if (description == nullptr) return shared;
  DRAPE_ASSIGN_OR_RETURN(auto its, Charge(owner, description, SizeOf_bytes(*description)));
  shared.charge = std::make_shared<const ModelCharge>(std::move(shared.charge), std::move(its));
  return shared;
}

Result<std::shared_ptr<const void>> ModelCache::Charge(const std::string& owner,
                                                       std::shared_ptr<const void> object,
                                                       uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  std::weak_ptr<const void>& entry = charges_[{owner, object.get()}];
  if (auto known = entry.lock()) return known;
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit, budget_.Take(owner, bytes));
  const std::shared_ptr<const void> charge =
      std::make_shared<const ObjectCharge>(std::move(object), std::move(permit));
  entry = charge;
  return charge;
}

Result<std::shared_ptr<const void>> ModelCache::ChargeLengths(const std::string& owner,
                                                              uint32_t count) {
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> bytes, budget_.Take(owner, kBytesPerLength * count));
  return std::shared_ptr<const void>(std::move(bytes));
}

Result<std::shared_ptr<const void>> ModelCache::ChargeColliders(const std::string& owner,
                                                                uint32_t count) {
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> bytes,
                         budget_.Take(owner, kBytesPerCollider * count));
  return std::shared_ptr<const void>(std::move(bytes));
}

std::shared_ptr<const SceneModel> ModelCache::Find(std::shared_ptr<const SceneModel> model) {
  while (true) {
    // Compared, and perhaps released, without the lock: models are large, and others wait for it.
    std::vector<std::shared_ptr<const SceneModel>> candidates;
    uint64_t found = 0;
    {
      const std::lock_guard lock(mutex_);
      found = additions_;
      const auto [begin, end] = models_.equal_range(model->content_hash());
      for (auto entry = begin; entry != end; ++entry) candidates.push_back(entry->second.lock());
    }
    for (const auto& candidate : candidates) {
      if (candidate != nullptr && candidate->SameContent(*model)) return candidate;
    }
    const std::lock_guard lock(mutex_);
    if (additions_ != found) continue;  // the same one may be there by now
    ++additions_;
    models_.emplace(model->content_hash(), model);
    if (std::max(models_.size(), charges_.size()) > next_sweep_size_) DropDead();
    return model;
  }
}

void ModelCache::DropDead() {
  std::erase_if(models_, [](const auto& entry) { return entry.second.expired(); });
  std::erase_if(charges_, [](const auto& entry) { return entry.second.expired(); });
  next_sweep_size_ = std::max<size_t>(64, 2 * std::max(models_.size(), charges_.size()));
}

size_t ModelCache::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(std::count_if(
      models_.begin(), models_.end(), [](const auto& entry) { return !entry.second.expired(); }));
}

}  // namespace drape
