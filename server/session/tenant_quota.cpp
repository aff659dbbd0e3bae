#include "server/session/tenant_quota.h"

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

Status TenantQuota::Take(const std::string& tenant, const Amount& amount) {
  if (tenant.empty()) return Status::Ok();
  const std::lock_guard lock(mutex_);
  const auto found = used_.find(tenant);
  const Amount used = found == used_.end() ? Amount{} : found->second;
  DRAPE_RETURN_IF_ERROR(CheckOne("max_sessions_per_tenant", limits_.max_sessions, used.sessions,
                                 amount.sessions));
  DRAPE_RETURN_IF_ERROR(
      CheckOne("max_cloths_per_tenant", limits_.max_cloths, used.cloths, amount.cloths));
  DRAPE_RETURN_IF_ERROR(CheckOne("max_particles_per_tenant", limits_.max_particles, used.particles,
                                 amount.particles));
  used_[tenant] = {used.sessions + amount.sessions, used.cloths + amount.cloths,
                   used.particles + amount.particles};
  return Status::Ok();
}

void TenantQuota::GiveBack(const std::string& tenant, const Amount& amount) {
  if (tenant.empty()) return;
  const std::lock_guard lock(mutex_);
  Amount& used = used_[tenant];
  used.sessions -= amount.sessions;
  used.cloths -= amount.cloths;
  used.particles -= amount.particles;
  if (used.sessions == 0 && used.cloths == 0 && used.particles == 0) used_.erase(tenant);
}

TenantQuota::Amount TenantQuota::UsedBy(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const auto found = used_.find(tenant);
  return found == used_.end() ? Amount{} : found->second;
}

}  // namespace drape
