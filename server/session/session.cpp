#include "server/session/session.h"

#include <random>
#include <unordered_set>
#include <utility>

#include "server/core/memory_reserve.h"
#include "server/session/cloth_creation.h"
#include "server/session/page_token.h"

namespace drape {
namespace {

TenantQuota::Amount AmountOf(const ClothList& cloths) {
  TenantQuota::Amount amount{.cloths = cloths.size()};
  for (const auto& cloth : cloths) {
    amount.AddParticles(cloth->description()->model->particle_count(), !cloth->world.empty());
  }
  return amount;
}

// Below 2^31 in both parts, so that no count wraps around.
ClothId RandomOrigin() {
  std::random_device random;
  return {random() >> 1, random() >> 1};
}

Status QuotaExceeded(const std::string& limit, uint64_t maximum, uint64_t used, uint64_t wanted) {
  return {StatusCode::kResourceExhausted, "QUOTA_EXCEEDED",
          limit + " is " + std::to_string(maximum) + ": " + std::to_string(used) + " in use, " +
              std::to_string(wanted) + " more wanted"};
}

}  // namespace

Session::Session(std::shared_ptr<SessionCommons> commons, std::string name,
                 std::string display_name, double ttl_s, std::string tenant)
    : Session(std::move(commons), std::move(name), std::move(display_name), ttl_s,
              std::move(tenant), IssuedIds{RandomOrigin(), {}}, 0) {}

Session::Session(std::shared_ptr<SessionCommons> commons, std::string name,
                 std::string display_name, double ttl_s, std::string tenant, IssuedIds issued,
                 double checkpoint_unix_s)
    : commons_(std::move(commons)),
      maps_(commons_->maps.Of(tenant)),
      name_(std::move(name)),
      display_name_(std::move(display_name)),
      ttl_s_(ttl_s),
      tenant_(std::move(tenant)),
      checkpoint_unix_s_(checkpoint_unix_s),
      request_memory_(commons_->limits.requests, commons_->clock, commons_->remembered,
                      commons_->request_ids, owner()),
      map_quota_(std::make_shared<MapQuota>(commons_->limits.max_mesh_collider_bytes_per_session,
                                            commons_->map_pool, owner())),
      table_(std::move(issued)) {}

Status Session::CheckQuota(uint64_t cloths, uint64_t particles) const {
  const SessionLimits& limits = commons_->limits;
  if (is_closed_) {
    return {StatusCode::kNotFound, "SESSION_NOT_FOUND", "the session has ended"};
  }
  if (cloths > limits.max_cloths_per_session - cloth_quota_used_) {
    return QuotaExceeded("max_cloths_per_session", limits.max_cloths_per_session, cloth_quota_used_,
                         cloths);
  }
  if (particles > limits.max_particles_per_session - particle_quota_used_) {
    return QuotaExceeded("max_particles_per_session", limits.max_particles_per_session,
                         particle_quota_used_, particles);
  }
  return Status::Ok();
}

Status Session::ReserveQuota(const TenantQuota::Amount& amount) {
  const std::lock_guard lock(mutex_);
  DRAPE_RETURN_IF_ERROR(CheckQuota(amount.cloths, amount.particles));
  DRAPE_RETURN_IF_ERROR(commons_->tenants.Take(tenant_, amount));
  cloth_quota_used_ += amount.cloths;
  particle_quota_used_ += amount.particles;
  return Status::Ok();
}

void Session::ReleaseQuota(const TenantQuota::Amount& amount) {
  commons_->tenants.GiveBack(tenant_, amount);
  const std::lock_guard lock(mutex_);
  cloth_quota_used_ -= amount.cloths;
  particle_quota_used_ -= amount.particles;
}

bool Session::Publish(const ClothList& records, bool keeps_ids) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return false;
  if (keeps_ids) {
    table_.Return(records, name_);
  } else {
    table_.Add(records, name_);
  }
  for (const auto& record : records) {
    cloths_.emplace(record->creation_number, record);
    EnterWorld(*record);
  }
  return true;
}

ClothList Session::Unpublish(const ClothList& cloths) {
  const std::lock_guard lock(mutex_);
  ClothList removed;
  for (const auto& cloth : cloths) {
    if (cloths_.erase(cloth->creation_number) == 0) continue;
    LeaveWorld(*cloth);
    removed.push_back(cloth);
  }
  table_.Remove(removed);
  return removed;
}

Result<ClothList> Session::FindCloths(std::span<const ClothId> ids) const {
  return WithinMemory([&] { return FindAll(ids); });
}

Result<ClothList> Session::FindAll(std::span<const ClothId> ids) const {
  ClothList cloths;
  if (ids.empty()) {
    const std::lock_guard lock(mutex_);
    cloths.reserve(cloths_.size());
    for (const auto& [number, cloth] : cloths_) cloths.push_back(cloth);
    return cloths;
  }
  std::unordered_set<ClothId> seen;
  cloths.reserve(ids.size());
  for (size_t k = 0; k < ids.size(); ++k) {
    if (!seen.insert(ids[k]).second) {
      return Status::InvalidField("cloth_ids[" + std::to_string(k) + "]",
                                  std::to_string(ids[k].Packed()) + " occurs twice");
    }
    cloths.push_back(table_.Find(ids[k], name_));
    if (cloths.back() == nullptr) return ClothNotFound(ids[k]);
  }
  return cloths;
}

Result<ClothPage> Session::ListCloths(uint32_t page_size, const std::string& page_token) const {
  DRAPE_ASSIGN_OR_RETURN(const uint64_t after, ParsePageToken(page_token));
  const uint32_t size = EffectivePageSize(page_size);
  const std::lock_guard lock(mutex_);
  ClothPage page;
  auto entry = cloths_.upper_bound(after);
  for (; entry != cloths_.end() && page.cloths.size() < size; ++entry) {
    page.cloths.push_back(entry->second);
  }
  if (entry != cloths_.end()) {
    page.next_page_token = MakePageToken(page.cloths.back()->creation_number);
  }
  return page;
}

void Session::DeleteCloths(ClothList cloths, std::function<void(Status)> done) {
  if (commons_->scheduler.is_draining()) return done(DrainingStatus());
  FreeOnDevice(Unpublish(cloths), std::move(done));
}

void Session::Close(std::function<void(Status)> done) {
  ClothList cloths;
  std::map<std::string, std::shared_ptr<const SavedStates>> saved;  // freed without the lock
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
    saved.swap(saved_);
    for (const auto& [number, cloth] : cloths_) cloths.push_back(cloth);
    cloths_.clear();
    worlds_.clear();
    table_.Remove(cloths);
  }
  FreeOnDevice(std::move(cloths), std::move(done));
}

bool Session::Free(ClothList cloths, const TenantQuota::Amount& amount,
                   std::function<void()> answer) {
  return FreeInSlices(commons_->scheduler, owner(), std::move(cloths),
                      [self = shared_from_this(), amount, answer](Backend&) {
                        self->ReleaseQuota(amount);
                        self->commons_->scheduler.Complete(answer);
                      });
}

void Session::FreeOnDevice(ClothList cloths, std::function<void(Status)> done) {
  const TenantQuota::Amount amount = AmountOf(cloths);
  // The backend and its cloths no longer exist. They may be in the last checkpoint, and come back.
  if (!Free(std::move(cloths), amount, [done] { done(Status::Ok()); })) {
    done(DrainingStatus());
  }
}

}  // namespace drape
