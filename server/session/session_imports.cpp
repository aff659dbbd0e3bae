// The method of Session that makes cloths of what was saved.
#include <algorithm>
#include <map>
#include <unordered_set>
#include <utility>

#include "server/session/cloth_import.h"
#include "server/session/session.h"
#include "server/session/sliced_command.h"

namespace drape {

// Every cloth gets its quota, the shared model of equal content, and the plan of this backend,
// wherever it was saved. What ReadSnapshot has charged already is found.
Status Session::Adopt(std::vector<SavedCloth>& cloths) {
  DistanceMapSet maps;
  for (const SavedCloth& cloth : cloths) Insert(cloth.description->parameters.colliders, maps);
  DRAPE_ASSIGN_OR_RETURN(const MapCharges charges, map_quota_->Charge(maps));
  std::map<const DistanceMap*, std::shared_ptr<const MapCharge>> charge_of;
  for (const auto& charge : charges) charge_of[charge->map()] = charge;
  std::map<const ModelDescription*, SharedModel> shared;
  for (SavedCloth& cloth : cloths) {
    auto description = std::make_shared<ClothDescription>(*cloth.description);
    SharedModel& known = shared[description->model_description.get()];
    if (known.model == nullptr) {
      DRAPE_ASSIGN_OR_RETURN(known, commons_->models.Share(owner(), description->model,
                                                           description->model_description));
    }
    const auto& model = description->model = known.model;
    cloth.charges.model = known.charge;
    description->plan = commons_->scheduler.description().plan_of(*model, description->parameters);
    DistanceMapSet its_maps;
    Insert(description->parameters.colliders, its_maps);
    cloth.charges.maps.clear();
    for (const auto& map : its_maps) cloth.charges.maps.push_back(charge_of.at(map.get()));
    if (cloth.collider_charge == nullptr) {
      DRAPE_ASSIGN_OR_RETURN(cloth.collider_charge, ChargeColliders(ColliderCountOf(*description)));
    }
    cloth.description = std::move(description);
    if (!cloth.runtime.lengths.is_driven()) continue;
    DRAPE_ASSIGN_OR_RETURN(cloth.length_charge, commons_->models.ChargeLengths(
                                                    owner(), model->described_constraint_count()));
  }
  return Status::Ok();
}

Result<std::vector<std::string>> Session::CheckImportedWorlds(
    const std::vector<SavedCloth>& cloths) const {
  struct Members {
    // Of all, or one that CheckWorld refuses.
    const SceneModel* model = nullptr;
    std::vector<const StepSettings*> settings;
  };
  std::map<std::string, Members> members;
  for (const SavedCloth& cloth : cloths) {
    if (cloth.world.empty()) continue;
    Members& its = members[cloth.world];
    const SceneModel& model = *cloth.description->model;
    if (its.model == nullptr || model.triangles().empty()) its.model = &model;
    its.settings.push_back(&cloth.description->parameters.settings);
  }
  std::vector<std::string> worlds;
  for (const auto& [world, its] : members) {
    DRAPE_RETURN_IF_ERROR(CheckWorld(world, *its.model, its.settings));
    worlds.push_back(world);
  }
  DRAPE_RETURN_IF_ERROR(CheckNewWorlds(worlds));
  return worlds;
}

Status Session::CheckNewWorlds(const std::vector<std::string>& worlds) const {
  const std::lock_guard lock(mutex_);
  for (const std::string& world : worlds) {
    if (!worlds_.contains(world)) continue;
    return Status::InvalidField("world", "the session has a world '" + world +
                                             "' already, in which the cloths would meet those "
                                             "that are there: import them into another session");
  }
  return Status::Ok();
}

Status Session::CheckReturn(const std::vector<SavedCloth>& cloths) const {
  std::unordered_set<ClothId> ids;
  for (size_t k = 0; k < cloths.size(); ++k) {
    if (table_.CanReturn(cloths[k].id) && ids.insert(cloths[k].id).second) continue;
    return Status::InvalidField("cloths[" + std::to_string(k) + "].cloth_id",
                                "is no id that a cloth of the session can have back");
  }
  return Status::Ok();
}

void Session::Import(std::vector<SavedCloth> cloths, bool keeps_ids,
                     std::function<void(Result<std::vector<ClothId>>)> done,
                     Interruption* interruption) {
  if (cloths.empty()) return done(std::vector<ClothId>{});
  if (keeps_ids) {
    if (const Status status = CheckReturn(cloths); !status.ok()) return done(status);
  }
  TenantQuota::Amount amount{.cloths = cloths.size()};
  uint64_t largest = 1;
  for (const SavedCloth& cloth : cloths) {
    amount.AddParticles(cloth.description->model->particle_count(), !cloth.world.empty());
    largest = std::max(largest, SliceCostOf(cloth));
  }
  Result<std::vector<std::string>> worlds = CheckImportedWorlds(cloths);
  if (!worlds.ok()) return done(worlds.status());
  const size_t count = cloths.size();
  const Status room = [&] {
    const std::lock_guard lock(mutex_);
    return CheckQuota(amount.cloths, amount.particles);
  }();
  if (!room.ok()) return done(room);
  // It may throw: before anything is taken.
  SharedParts made = PrepareImport(cloths, commons_->scheduler.description(), interruption);
  if (const Status status = ReserveQuota(amount); !status.ok()) return done(status);
  if (const Status status = Adopt(cloths); !status.ok()) {
    ReleaseQuota(amount);
    return done(status);
  }
  const auto maker = std::make_shared<ImportMaker>(std::move(cloths));
  const Status status = RunInSlices(
      commons_->scheduler, owner(), count, ClothsPerSlice(largest),
      [maker](Backend& backend, size_t begin, size_t end) {
        return maker->Make(backend, begin, end);
      },
      [self = shared_from_this(), maker, keeps_ids, done, amount, made = std::move(made),
       worlds = std::move(*worlds)](Backend&, const Status& outcome) {
        Result<std::vector<ClothId>> answer = std::vector<ClothId>{};
        const Status are_new = self->CheckNewWorlds(worlds);
        if (!outcome.ok()) {
          answer = outcome;
        } else if (!are_new.ok()) {
          answer = are_new;
        } else if (!self->Publish(maker->made(), keeps_ids)) {
          answer = Status(StatusCode::kNotFound, "SESSION_NOT_FOUND", "the session has ended");
        } else {
          self->JoinWorlds(maker->made());
          for (const auto& cloth : maker->made()) answer->push_back(cloth->id);
        }
        if (answer.ok()) {
          return self->commons_->scheduler.Complete(
              [done, answer = std::move(answer)] { done(answer); });
        }
        const bool is_taken =
            self->Free(maker->TakeMade(), amount, [done, answer] { done(answer); });
        DRAPE_CHECK(is_taken, "the device thread takes commands as long as it runs one");
      });
  if (status.ok()) return;
  ReleaseQuota(amount);
  done(status);
}

}  // namespace drape
