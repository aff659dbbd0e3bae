// The methods of Session that create and change cloths on the device.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "server/core/check.h"
#include "server/session/cloth_creation.h"
#include "server/session/cloth_hold.h"
#include "server/session/cloth_update.h"
#include "server/session/preparation.h"
#include "server/session/session.h"
#include "server/session/sliced_command.h"
#include "server/session/start_cost.h"

namespace drape {
namespace {

DistanceMapSet MapsOf(const ClothCreation& creation) {
  DistanceMapSet maps;
  for (const ClothCopy& copy : creation.copies) Insert(copy.parameters.colliders, maps);
  return maps;
}

std::shared_ptr<const ClearStart> StartOf(const ClothCreation& creation) {
  std::shared_ptr<const ClearStart> start;
  for (const ClothCopy& copy : creation.copies) {
    if (copy.start == nullptr) continue;
    if (copy.start->clearance == StartClearance::kCleared) return copy.start;
    start = copy.start;
  }
  return start;
}

}  // namespace

namespace {

std::vector<const StepSettings*> SettingsOf(const ClothCreation& creation) {
  std::vector<const StepSettings*> settings;
  for (const ClothCopy& copy : creation.copies) settings.push_back(&copy.parameters.settings);
  return settings;
}

}  // namespace

void Session::CreateCloths(ClothCreation creation,
                           std::function<void(Result<CreatedCloths>)> done) {
  DRAPE_CHECK(!creation.copies.empty(), "at least one copy");
  if (const Status status = CheckWorld(creation.world, *creation.model, SettingsOf(creation));
      !status.ok()) {
    done(status);
    return;
  }
  const size_t cloths = creation.copies.size();
  TenantQuota::Amount amount{.cloths = cloths};
  amount.AddParticles(uint64_t{creation.model->particle_count()} * cloths, !creation.world.empty());
  Result<MapCharges> charges = map_quota_->Charge(MapsOf(creation));
  if (!charges.ok()) {
    done(charges.status());
    return;
  }
  creation.map_charges = std::move(charges).value();
  if (const Status status = ReserveQuota(amount); !status.ok()) {
    done(status);
    return;
  }
  if (const Status status = ShareModels(creation); !status.ok()) {
    ReleaseQuota(amount);
    return done(status);
  }
  auto model = creation.model;
  uint64_t largest = 1;
  for (const ClothCopy& copy : creation.copies) {
    largest = std::max(largest, SliceCost(*model, copy.parameters));
  }
  const size_t per_slice = ClothsPerSlice(largest);
  auto start = StartOf(creation);
  std::string plan =
      commons_->scheduler.description().plan_of(*model, creation.copies[0].parameters);
  auto maker = std::make_shared<ClothMaker>(std::move(creation), std::move(model), std::move(plan));
  const auto finish = [self = shared_from_this(), maker, start = std::move(start), done, amount](
                          Backend&, const Status& status) {
    Result<CreatedCloths> answer = self->PublishMade(*maker, status);
    if (answer.ok()) {
      answer->start = start;
      return self->commons_->scheduler.Complete(
          [done, answer = std::move(answer)] { done(answer); });
    }
    const bool is_taken = self->Free(maker->TakeMade(), amount, [done, answer] { done(answer); });
    DRAPE_CHECK(is_taken, "the device thread takes commands as long as it runs one");
  };
  const Status status = RunInSlices(
      commons_->scheduler, owner(), cloths, per_slice,
      [maker](Backend& backend, size_t begin, size_t end) {
        return maker->Make(backend, begin, end);
      },
      finish);
  if (!status.ok()) {
    ReleaseQuota(amount);
    done(status);
  }
}

Status Session::ShareModels(ClothCreation& creation) {
  DRAPE_ASSIGN_OR_RETURN(SharedModel shared,
                         commons_->models.Share(owner(), creation.model, creation.description));
  creation.model = std::move(shared.model);
  creation.model_charge = std::move(shared.charge);
  for (ClothCopy& copy : creation.copies) {
    DRAPE_ASSIGN_OR_RETURN(copy.collider_charge, ChargeColliders(copy.parameters.colliders.size()));
    if (copy.model == nullptr) continue;
    DRAPE_ASSIGN_OR_RETURN(SharedModel own,
                           commons_->models.Share(owner(), copy.model, copy.description));
    copy.model = std::move(own.model);
    copy.model_charge = std::move(own.charge);
  }
  return Status::Ok();
}

Result<CreatedCloths> Session::PublishMade(const ClothMaker& maker, const Status& status) {
  DRAPE_RETURN_IF_ERROR(status);
  // Again, because others may have entered the world since.
  DRAPE_RETURN_IF_ERROR(
      CheckWorld(maker.creation().world, *maker.model(), SettingsOf(maker.creation())));
  if (!Publish(maker.made())) {
    return Status(StatusCode::kNotFound, "SESSION_NOT_FOUND", "the session has ended");
  }
  JoinWorlds(maker.made());
  CreatedCloths created;
  created.model = maker.model();
  created.plan = maker.plan();
  created.elastic_limit = ElasticLimitOf(*maker.model(), maker.creation().copies[0].parameters);
  for (const auto& cloth : maker.made()) created.ids.push_back(cloth->id);
  return created;
}

void Session::CheckCloths(ClothCreation creation, std::function<void(Result<CreatedCloths>)> done) {
  Status status = CheckWorld(creation.world, *creation.model, SettingsOf(creation));
  if (status.ok()) status = map_quota_->Charge(MapsOf(creation)).status();
  if (status.ok()) {
    const std::lock_guard lock(mutex_);
    status = CheckQuota(creation.copies.size(),
                        uint64_t{creation.model->particle_count()} * creation.copies.size());
  }
  if (!status.ok()) return done(status);
  done(CreatedCloths{
      .ids = {},
      .model = creation.model,
      .plan =
          commons_->scheduler.description().plan_of(*creation.model, creation.copies[0].parameters),
      .start = StartOf(creation),
      .elastic_limit = ElasticLimitOf(*creation.model, creation.copies[0].parameters)});
}

namespace {

// Makes the change in slices, or takes it back, and calls `finish` with the outcome, on the device
// thread. `stop_reason` is asked before each slice; empty: nothing stops it.
Status RunUpdate(Scheduler& scheduler, const std::string& owner,
                 const std::shared_ptr<ClothUpdater>& updater, std::function<Status()> stop_reason,
                 std::function<void(Backend&, const Status&)> finish) {
  const size_t count = updater->cloths().size();
  const size_t per_slice = ClothsPerSlice(updater->cloths());
  const auto hold = std::make_shared<ClothHold>();
  const auto end = [hold, finish = std::move(finish)](Backend& backend, const Status& outcome) {
    hold->Release();
    finish(backend, outcome);
  };
  const auto commit = [updater](Backend&, size_t begin, size_t slice_end) {
    updater->Commit(begin, slice_end);
    return Status::Ok();
  };
  const auto take_back = [updater](Backend& backend, size_t begin, size_t slice_end) {
    updater->TakeBack(backend, slice_end - begin);
    return Status::Ok();
  };
  return RunAsOne(
      scheduler, owner, count, per_slice,
      [=, stop_reason = std::move(stop_reason)](Backend& backend, size_t begin, size_t slice_end) {
        if (stop_reason) DRAPE_RETURN_IF_ERROR(stop_reason());
        if (begin == 0) DRAPE_RETURN_IF_ERROR(updater->Begin());
        if (begin == 0 && slice_end < count) hold->Take(updater->cloths());
        return updater->Write(backend, begin, slice_end);
      },
      [=, &scheduler](Backend& backend, const Status& written) {
        if (written.ok()) {
          return ContinueAsOne(backend, scheduler, owner, count, per_slice, commit, end);
        }
        ContinueAsOne(backend, scheduler, owner, updater->written(), per_slice, take_back,
                      [updater, end, written](Backend& b, const Status&) {
                        end(b, updater->Error(written));
                      });
      });
}

}  // namespace

void Session::UpdateCloths(ClothList cloths, ClothChange change,
                           std::function<void(Result<UpdatedCloths>)> done, const ModelRules& rules,
                           std::function<Status()> stop_reason, Interruption* interruption) {
  DRAPE_CHECK(!cloths.empty(), "at least one cloth");
  const bool touches_itself = change.self_collision && *change.self_collision;
  for (const auto& cloth : cloths) {
    if (!touches_itself || !cloth->description()->model->triangles().empty()) continue;
    done(Status::InvalidField("spec.self_collision",
                              "belongs to cloths with triangles, made of a grid or a mesh; one of "
                              "the cloths has none"));
    return;
  }
  if (change.colliders) {
    DistanceMapSet maps;
    Insert(*change.colliders, maps);
    Result<MapCharges> charges = map_quota_->Charge(maps);
    if (!charges.ok()) {
      done(charges.status());
      return;
    }
    change.map_charges = std::move(charges).value();
  }
  if (change.colliders) {
    std::vector<CountedCloth> counted;
    const auto count = static_cast<uint32_t>(change.colliders->size());
    for (const auto& cloth : cloths) counted.push_back({cloth, count});
    if (const Status status = HoldColliders(counted); !status.ok()) return done(status);
  }
  std::vector<ChangedModel> models;
  if (change.needs_model()) {
    auto built = BuildChangedModels(cloths, change, rules, owner(), commons_->models, interruption);
    if (!built.ok()) {
      done(built.status());
      return;
    }
    models = std::move(built).value();
  }
  SharedParts made;
  const BackendDescription& backend = commons_->scheduler.description();
  if (!models.empty() || (backend.prepare && change.may_need_programs()) ||
      (backend.make_shared_parts && MayNeedParts(cloths, change))) {
    made = PrepareUpdate(cloths, change, models, backend, interruption);
  }
  const auto updater = std::make_shared<ClothUpdater>(std::move(cloths), std::move(change),
                                                      std::move(models), rules);
  const Status status = RunUpdate(
      commons_->scheduler, owner(), updater, std::move(stop_reason),
      [self = shared_from_this(), updater, done, made](Backend&, const Status& outcome) {
        if (!outcome.ok()) self->DropEnded(updater->cloths());
        const auto& first = updater->cloths().front();
        self->commons_->scheduler.Complete(
            [done, outcome, description = first->description(), start = first->start()] {
              if (outcome.ok()) {
                done(UpdatedCloths{description->model, description->plan, start,
                                   ElasticLimitOf(*description->model, description->parameters)});
              } else {
                done(outcome);
              }
            });
      });
  if (!status.ok()) done(status);
}

void Session::DropEnded(const ClothList& cloths) {
  ClothList ended;
  for (const auto& cloth : cloths) {
    if (!cloth->runtime->is_alive()) ended.push_back(cloth);
  }
  if (!ended.empty()) DeleteCloths(std::move(ended), [](const Status&) {});
}

void Session::ResetCloths(ClothList cloths, ClothStarts starts, std::function<void(Status)> done) {
  if (cloths.empty()) {
    done(Status::Ok());
    return;
  }
  const auto held = std::make_shared<const ClothList>(std::move(cloths));
  const size_t per_slice = ClothsPerSlice(*held);
  std::function<void(Backend&, const Status&)> finish = [self = shared_from_this(), held, done](
                                                            Backend&, const Status& outcome) {
    if (!outcome.ok()) self->DropEnded(*held);
    self->commons_->scheduler.Complete([done, outcome] { done(outcome); });
  };
  const bool has_overrides = !starts.overrides.empty();
  const auto updater =
      has_overrides ? std::make_shared<ClothUpdater>(*held, OverridesOf(starts)) : nullptr;
  auto reset = [held, starts = std::move(starts)](Backend& backend, size_t begin, size_t end) {
    if (begin == 0) DRAPE_RETURN_IF_ERROR(CheckAlive(*held));
    for (size_t k = begin; k < end; ++k) {
      DRAPE_RETURN_IF_ERROR(ResetCloth(backend, *(*held)[k], starts.TransformOf(k)));
    }
    return Status::Ok();
  };
  Scheduler& scheduler = commons_->scheduler;
  const Status status =
      has_overrides
          ? RunUpdate(scheduler, owner(), updater, {},
                      [=, &scheduler, owner = owner()](Backend& backend, const Status& updated) {
                        if (!updated.ok()) return finish(backend, updated);
                        ContinueAsOne(backend, scheduler, owner, held->size(), per_slice, reset,
                                      finish);
                      })
          : RunAsOne(scheduler, owner(), held->size(), per_slice, reset, finish);
  if (!status.ok()) done(status);
}

void Session::WriteStates(ClothList cloths, std::vector<ParticleState> states,
                          std::function<void(Status)> done) {
  DRAPE_CHECK(cloths.size() == states.size(), "one state per cloth");
  if (cloths.empty()) return done(Status::Ok());
  const auto held = std::make_shared<const ClothList>(std::move(cloths));
  const Status status = RunInSlices(
      commons_->scheduler, owner(), held->size(), ClothsPerSlice(*held),
      [held, states = std::move(states)](Backend& backend, size_t begin, size_t end) {
        if (begin == 0) DRAPE_RETURN_IF_ERROR(CheckAlive(*held));
        const std::span<const std::shared_ptr<ClothRecord>> all(*held);
        return WriteOnDevice(backend, all.subspan(begin, end - begin),
                             std::span(states).subspan(begin, end - begin));
      },
      [self = shared_from_this(), done](Backend&, const Status& outcome) {
        self->commons_->scheduler.Complete([done, outcome] { done(outcome); });
      });
  if (!status.ok()) done(status);
}

}  // namespace drape
