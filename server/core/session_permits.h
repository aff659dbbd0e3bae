// Limits how many of something there are at a time, per session, per owner and in all.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/core/status.h"

namespace drape {

// The name is that of the setting, for messages.
struct PermitLimit {
  std::string name;
  uint32_t value = 0;
};

// Thread-safe.
class SessionPermits {
 public:
  // Refusals are RESOURCE_EXHAUSTED with `reason`; `retry_after_ms` unless waiting does not help.
  SessionPermits(std::string reason, PermitLimit per_session, std::optional<PermitLimit> in_all,
                 std::optional<int64_t> retry_after_ms);

  // A permit is given back when the last copy of the pointer is gone, which may outlive this. With
  // an empty session name only the limit in all applies. An owner (the tenant, or else the session)
  // has at most as many as it leaves free of all: one alone half of them, each of N its share of
  // N + 1, so that whoever comes next finds some.
  Result<std::shared_ptr<void>> Take(const std::string& session, const std::string& tenant = {});

 private:
  struct Counts;

  Status Refusal(const PermitLimit& limit) const;

  const std::string reason_;
  const PermitLimit per_session_;
  const std::optional<PermitLimit> in_all_;
  const std::optional<int64_t> retry_after_ms_;
  const std::shared_ptr<Counts> counts_;
};

}  // namespace drape
