#include "server/session/tenant_quota.h"

#include <algorithm>

namespace drape {
namespace {

Status CheckOne(const char* limit, uint64_t maximum, uint64_t used, uint64_t wanted) {
  if (maximum == 0 || wanted == 0 || (used <= maximum && wanted <= maximum - used)) {
    return Status::Ok();
  }
  return {StatusCode::kResourceExhausted, "QUOTA_EXCEEDED",
          std::string(limit) + " is " + std::to_string(maximum) + ": " + std::to_string(used) +
              " in use, " + std::to_string(wanted) + " more wanted"};
}

}  // namespace

uint64_t StateBytes(const TenantQuota::Amount& amount) {
  constexpr uint64_t kPerCloth = 8192, kPerParticle = 160, kPerWorldParticle = 256;
  return kPerCloth * amount.cloths + kPerParticle * amount.particles +
         kPerWorldParticle * amount.world_particles;
}

Status TenantQuota::CheckStates(bool is_tenant, uint64_t held_bytes, uint64_t wanted_bytes) const {
  if (max_state_bytes_ == 0) return Status::Ok();
  DRAPE_RETURN_IF_ERROR(CheckOne("max_state_bytes", max_state_bytes_, state_bytes_, wanted_bytes));
  if (!is_tenant || held_bytes == 0) return Status::Ok();
  return CheckOne("what a tenant leaves free of max_state_bytes",
                  std::max<uint64_t>(1, max_state_bytes_ - state_bytes_), held_bytes, wanted_bytes);
}

Status TenantQuota::Take(const std::string& tenant, const Amount& amount) {
  const std::lock_guard lock(mutex_);
  const uint64_t wanted_bytes = StateBytes(amount);
  const auto found = used_.find(tenant);
  const Amount used = found == used_.end() ? Amount{} : found->second;
  if (!tenant.empty()) {
    DRAPE_RETURN_IF_ERROR(
        CheckOne("max_sessions_per_tenant", limits_.max_sessions, used.sessions, amount.sessions));
    DRAPE_RETURN_IF_ERROR(
        CheckOne("max_cloths_per_tenant", limits_.max_cloths, used.cloths, amount.cloths));
    DRAPE_RETURN_IF_ERROR(CheckOne("max_particles_per_tenant", limits_.max_particles,
                                   used.particles, amount.particles));
  }
  DRAPE_RETURN_IF_ERROR(CheckStates(!tenant.empty(), StateBytes(used), wanted_bytes));
  used_[tenant] = {used.sessions + amount.sessions, used.cloths + amount.cloths,
                   used.particles + amount.particles,
                   used.world_particles + amount.world_particles};
  state_bytes_ += wanted_bytes;
  return Status::Ok();
}

void TenantQuota::GiveBack(const std::string& tenant, const Amount& amount) {
  const std::lock_guard lock(mutex_);
  Amount& used = used_[tenant];
  used.sessions -= amount.sessions;
  used.cloths -= amount.cloths;
  used.particles -= amount.particles;
  used.world_particles -= amount.world_particles;
  if (used.sessions == 0 && used.cloths == 0 && used.particles == 0) used_.erase(tenant);
  state_bytes_ -= StateBytes(amount);
}

TenantQuota::Amount TenantQuota::UsedBy(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const auto found = used_.find(tenant);
  return found == used_.end() ? Amount{} : found->second;
}

}  // namespace drape
