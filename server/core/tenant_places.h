// A number of places, shared out among tenants.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/core/status.h"

namespace drape {

// The name is that of the setting, for messages.
struct PlaceLimit {
  std::string name;
  uint32_t value = 0;
};

// Thread-safe.
class TenantPlaces {
 public:
  // Refusals are RESOURCE_EXHAUSTED with `reason`; `retry_after_ms` unless waiting does not help.
  TenantPlaces(std::string reason, PlaceLimit per_tenant, std::optional<PlaceLimit> in_all,
               std::optional<int64_t> retry_after_ms);

  // Taken until the last copy of the pointer is gone, which may outlive this. An empty tenant is
  // counted in all alone.
  Result<std::shared_ptr<void>> Take(const std::string& tenant);

 private:
  struct Counts;

  Status Refusal(const PlaceLimit& limit) const;

  const std::string reason_;
  const PlaceLimit per_tenant_;
  const std::optional<PlaceLimit> in_all_;
  const std::optional<int64_t> retry_after_ms_;
  const std::shared_ptr<Counts> counts_;
};

}  // namespace drape
