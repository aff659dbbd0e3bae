// The methods of Session that keep states of cloths by name.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/session/cloth_creation.h"
#include "server/session/cloth_hold.h"
#include "server/session/cloth_reset.h"
#include "server/session/driven_lengths.h"
#include "server/session/session.h"
#include "server/session/sliced_command.h"

namespace drape {
void Session::SaveStates(ClothList cloths, std::string name,
                         std::function<void(Result<SavedSummary>)> done) {
  const auto held = std::make_shared<const ClothList>(std::move(cloths));
  const auto saved = std::make_shared<SavedStates>();
  const auto hold = std::make_shared<ClothHold>();
  const Status status = RunAsOne(
      commons_->scheduler, owner(), held->size(), ClothsPerSlice(*held),
      [self = shared_from_this(), held, hold, saved](Backend& backend, size_t begin, size_t end) {
        if (begin == 0) DRAPE_RETURN_IF_ERROR(CheckAlive(*held));
        if (begin == 0 && end < held->size()) hold->Take(*held);
        DRAPE_RETURN_IF_ERROR(SaveOnDevice(backend, std::span(*held).subspan(begin, end - begin),
                                           *self->commons_->saved, self->owner(), *saved));
        HoldParts(self->commons_->scheduler.description(), std::span(saved->cloths).subspan(begin));
        return Status::Ok();
      },
      [self = shared_from_this(), hold, saved, name, done](Backend&, const Status& outcome) {
        hold->Release();
        Result<SavedSummary> answer = SavedSummary{saved->cloths.size(), saved->bytes};
        if (!outcome.ok()) {
          answer = outcome;
        } else if (const Status kept = self->Keep(name, saved); !kept.ok()) {
          answer = kept;
        }
        self->commons_->scheduler.Complete([done, answer = std::move(answer)] { done(answer); });
      });
  if (!status.ok()) done(status);
}

Status Session::Keep(const std::string& name, std::shared_ptr<const SavedStates> saved) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return {StatusCode::kNotFound, "SESSION_NOT_FOUND", "the session has ended"};
  if (saved_.size() >= kMaxSavedNames && !saved_.contains(name)) {
    return {StatusCode::kResourceExhausted, "TOO_MANY_SAVED_STATES",
            "a session keeps at most " + std::to_string(kMaxSavedNames) + " names: drop some"};
  }
  saved_[name] = std::move(saved);
  return Status::Ok();
}

std::shared_ptr<const SavedStates> Session::FindSaved(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = saved_.find(name);
  return found == saved_.end() ? nullptr : found->second;
}

Result<std::vector<LoadPair>> Session::PairsOf(const SavedStates& saved,
                                               std::span<const ClothId> into,
                                               std::span<const ClothId> from) const {
  std::vector<ClothId> every;
  if (into.empty()) {
    for (const SavedCloth& cloth : saved.cloths) every.push_back(cloth.id);
    if (every.empty()) return std::vector<LoadPair>{};
    into = every;
  }
  if (from.empty()) from = into;
  DRAPE_ASSIGN_OR_RETURN(const ClothList cloths, FindCloths(into));
  std::unordered_map<ClothId, const SavedCloth*> by_id;
  for (const SavedCloth& cloth : saved.cloths) by_id.emplace(cloth.id, &cloth);
  std::vector<LoadPair> pairs;
  for (size_t k = 0; k < cloths.size(); ++k) {
    const auto found = by_id.find(from[k]);
    const std::string field = "cloth_ids[" + std::to_string(k) + "]";
    if (found == by_id.end()) {
      return Status::InvalidField(field, "cloth " + std::to_string(from[k].Packed()) +
                                             " is not among those that were saved");
    }
    DRAPE_RETURN_IF_ERROR(CheckLoads(*cloths[k], *found->second, field));
    pairs.push_back({cloths[k], found->second});
  }
  return pairs;
}

Result<StateLoads> Session::FindLoads(const std::string& name, std::span<const ClothId> into,
                                      std::span<const ClothId> from) const {
  StateLoads loads{FindSaved(name), {}};
  if (loads.saved == nullptr) return SavedStatesNotFound(name);
  DRAPE_ASSIGN_OR_RETURN(loads.pairs, PairsOf(*loads.saved, into, from));
  return loads;
}

Status Session::HoldColliders(std::span<const CountedCloth> cloths) const {
  return HoldAll(cloths, &ClothRecord::held_colliders,
                 [this](uint32_t count) { return ChargeColliders(count); });
}

Status Session::ChargeDriven(std::span<const CountedCloth> driven) const {
  return HoldAll(driven, &ClothRecord::held_lengths,
                 [this](uint32_t count) { return commons_->models.ChargeLengths(owner(), count); });
}

Status Session::ChargeLoads(std::span<const LoadPair> pairs) const {
  std::vector<CountedCloth> colliders;
  for (const LoadPair& pair : pairs) {
    colliders.push_back({pair.into, ColliderCountOf(*pair.from->description)});
  }
  DRAPE_RETURN_IF_ERROR(HoldColliders(colliders));
  return ChargeDriven(DrivenBy(pairs));
}

void Session::LoadStates(const std::string& name, std::span<const ClothId> into,
                         std::span<const ClothId> from, std::function<void(Status)> done) {
  auto found = FindLoads(name, into, from);
  if (!found.ok()) return done(found.status());
  const auto loads = std::make_shared<const StateLoads>(std::move(found).value());
  if (const Status status = ChargeLoads(loads->pairs); !status.ok()) return done(status);
  uint64_t largest = 1;
  for (const LoadPair& pair : loads->pairs) largest = std::max(largest, SliceCostOf(*pair.from));
  const auto hold = std::make_shared<ClothHold>();
  const Status status = RunAsOne(
      commons_->scheduler, owner(), loads->pairs.size(), ClothsPerSlice(largest),
      [loads, hold](Backend& backend, size_t begin, size_t end) {
        const std::span<const LoadPair> pairs(loads->pairs);
        if (begin == 0) DRAPE_RETURN_IF_ERROR(CheckLoadsNow(pairs));
        if (begin == 0 && end < pairs.size()) {
          for (const LoadPair& pair : pairs) hold->Take(*pair.into);
        }
        return LoadOnDevice(backend, pairs.subspan(begin, end - begin));
      },
      [self = shared_from_this(), loads, hold, done](Backend&, const Status& outcome) {
        hold->Release();
        self->commons_->scheduler.Complete([done, outcome] { done(outcome); });
      });
  if (!status.ok()) done(status);
}

Status Session::DropStates(const std::string& name) {
  std::shared_ptr<const SavedStates> dropped;  // freed without the lock
  const std::lock_guard lock(mutex_);
  const auto found = saved_.find(name);
  if (found == saved_.end()) return SavedStatesNotFound(name);
  dropped = std::move(found->second);
  saved_.erase(found);
  return Status::Ok();
}

}  // namespace drape
