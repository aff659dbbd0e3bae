// All sessions of a server and their leases.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "server/core/clock.h"
#include "server/core/log_limit.h"
#include "server/core/status.h"
#include "server/session/session.h"

namespace drape {

class SessionRegistry;

// Keeps a session alive while a request is under way: the session does not expire. Its creation and
// its destruction renew the session's time to live. Movable. The registry must outlive it.
class SessionLease {
 public:
  SessionLease() = default;
  SessionLease(SessionLease&& other) noexcept;
  SessionLease& operator=(SessionLease&& other) noexcept;
  ~SessionLease();

  Session* operator->() const { return session_.get(); }
  Session& operator*() const { return *session_; }
  const std::shared_ptr<Session>& session() const { return session_; }
  explicit operator bool() const { return session_ != nullptr; }

 private:
  friend class SessionRegistry;
  SessionLease(SessionRegistry* registry, std::shared_ptr<Session> session)
      : registry_(registry), session_(std::move(session)) {}
  void Release();

  SessionRegistry* registry_ = nullptr;
  std::shared_ptr<Session> session_;
};

// A session as lists and answers show it.
struct SessionView {
  uint64_t number = 0;  // in order of creation
  std::string name;     // in full; shorten it (ShortSessionName) before showing it to other clients
  std::string tenant;
  std::string display_name;
  double ttl_s = 0;
  double remaining_s = 0;  // the whole ttl while a request is under way
  uint32_t cloth_count = 0;
  uint64_t particle_count = 0;
};

struct SessionPage {
  std::vector<SessionView> sessions;
  std::string next_page_token;  // empty: the last page
};

// A session of an earlier run of the server.
struct FormerSession {
  std::string name;
  std::string display_name;
  double ttl_s = 0;
  std::string tenant;
  IssuedIds issued;
  double checkpoint_unix_s = 0;  // when it was as it comes back
};

struct ServerTotals {
  uint32_t session_count = 0;
  uint32_t cloth_count = 0;
  uint64_t particle_count = 0;
};

// Of one tenant, or of all sessions without one.
struct TenantTotals {
  ServerTotals totals;
  std::vector<std::string> owners;  // of its sessions, each once (Session::owner)
};

// "sessions/<server id>-<32 hexadecimal digits>" -> "sessions/<server id>-<first 4 digits>...".
std::string ShortSessionName(const std::string& name);

// Thread-safe. Destroy it after Scheduler::Drain and before the scheduler.
class SessionRegistry {
 public:
  // `server_id`: lower-case letters and digits; a proxy routes by it. `has_lasting_id`: it is the
  // same after a restart, so another id in a name means another server (WRONG_SERVER). `scheduler`
  // and `clock` outlive the registry.
  SessionRegistry(Scheduler& scheduler, const SessionLimits& limits, const Clock& clock,
                  std::string server_id, bool has_lasting_id = false);

  // A new session. Its name has 128 random bits; knowing the name gives access.
  // INVALID_ARGUMENT "ttl_s" outside [kMinTtl_s, kMaxTtl_s] or not finite, "display_name" too long;
  // RESOURCE_EXHAUSTED (TOO_MANY_SESSIONS).
  // The session belongs to `tenant` (empty: a server without tokens), which may exceed its own
  // quota, too (QUOTA_EXCEEDED).
  Result<SessionLease> Create(std::optional<double> ttl_s, const std::string& display_name,
                              const std::string& tenant = {});
  // A session as it was, with a whole lease and without cloths. INVALID_ARGUMENT for what Create
  // could not have made or for a name that is there, RESOURCE_EXHAUSTED as Create.
  Result<SessionLease> Return(FormerSession former);
  // All that have not been deleted or reaped, in order of creation. Does not renew them.
  std::vector<std::shared_ptr<Session>> All() const;
  // Called by ReapExpired with each session before its cloths are deleted. Set once, before the
  // Reaper.
  void SetBeforeExpiry(std::function<void(const std::shared_ptr<Session>&)> before) {
    before_expiry_ = std::move(before);
  }
  // From now on the name answers SESSION_LOST where it would answer SESSION_NOT_FOUND: for sessions
  // of an earlier run that cannot be returned.
  void RememberLost(const std::string& name, const std::string& tenant);
  // Names and tenants of those that are still remembered, oldest first.
  std::vector<std::pair<std::string, std::string>> LostNames() const;
  // To all others but its tenant a session is NOT_FOUND (SESSION_NOT_FOUND), here and below.
  // The session for a request; renews it. NOT_FOUND: SESSION_EXPIRED for a while after expiry, then
  // SESSION_NOT_FOUND. A session is expired once its time is over, even if it was not reaped yet.
  Result<SessionLease> Find(const std::string& name, const std::string& tenant = {});
  // The present view of the session. Does not renew it. Errors as Find.
  Result<SessionView> Get(const std::string& name, const std::string& tenant = {}) const;
  // Those of the tenant, in order of creation. Page rules as Session::ListCloths.
  Result<SessionPage> List(uint32_t page_size, const std::string& page_token,
                           const std::string& tenant = {}) const;
  // The same of all tenants.
  Result<SessionPage> ListAll(uint32_t page_size, const std::string& page_token) const;
  // Find, then Get.
  Result<SessionView> Renew(const std::string& name, const std::string& tenant = {});
  // Removes the session at once; `done` (as Session::DeleteCloths) when its cloths are freed.
  // Requests under way end with NOT_FOUND. Errors as Find.
  void Delete(const std::string& name, std::function<void(Status)> done,
              const std::string& tenant = {});

  // The same by SessionView::number, of any tenant.
  void Drop(uint64_t number, std::function<void(Status)> done);

  // Removes every session whose time is over, and its cloths. Returns how many. Called by a Reaper.
  size_t ReapExpired();

  // Of the sessions of the tenant.
  ServerTotals Totals(const std::string& tenant = {}) const;
  // Of all sessions, and what RequestMemory keeps for them.
  ServerTotals TotalsOfAll() const;
  std::map<std::string, TenantTotals> TotalsByTenant() const;
  uint64_t remembered_bytes() const { return commons_->remembered->used_bytes(); }
  uint64_t saved_bytes() const { return commons_->saved->used_bytes(); }
  uint64_t remembered_bytes(const std::string& owner) const {
    return commons_->remembered->used_bytes(owner);
  }
  uint64_t saved_bytes(const std::string& owner) const {
    return commons_->saved->used_bytes(owner);
  }
  const SessionLimits& limits() const { return commons_->limits; }

 private:
  friend class SessionLease;
  struct Entry {
    std::shared_ptr<Session> session;
    uint64_t creation_number = 0;
    uint64_t number_of_tenant = 0;  // the same among the sessions that its tenant ever had
    int64_t expires_us = 0;         // counts only while nothing is under way
    uint32_t under_way = 0;         // leases
  };

  // --- With mutex_ held.
  bool IsExpired(const Entry& entry, int64_t now_us) const;
  Status CheckLive(const std::string& name, const std::string& tenant) const;
  // Those of one tenant; null: of all.
  Result<SessionPage> ListOf(uint32_t page_size, const std::string& page_token,
                             const std::string* tenant) const;
  SessionView ViewOf(const Entry& entry, int64_t now_us) const;
  void RenewEntry(Entry& entry);
  // With one lease; the quota of the tenant is taken, or the limit that forbids it is named.
  Result<SessionLease> Insert(std::shared_ptr<Session> session);
  void Remove(const std::string& name);
  void RememberEnded(const std::string& name, const std::string& tenant, const Status& answer);

  void EndLease(const Session& session);
  // A line about a session; a bounded number per second.
  void LogEvent(const std::string& line);

  const Clock& clock_;
  const std::string server_id_;
  const bool has_lasting_id_;
  LogLimit log_limit_;
  const std::shared_ptr<SessionCommons> commons_;
  std::function<void(const std::shared_ptr<Session>&)> before_expiry_;

  mutable std::mutex mutex_;
  std::unordered_map<std::string, Entry> sessions_;    // by name
  std::map<uint64_t, std::string> names_by_creation_;  // for lists
  uint64_t next_creation_number_;
  std::unordered_map<std::string, uint64_t> last_number_of_tenant_;  // no more tenants than tokens
  // Sessions that have ended, but not because somebody deleted them.
  struct Ended {
    std::string tenant;
    Status answer;
  };
  std::deque<std::string> ended_;  // oldest first
  std::unordered_map<std::string, Ended> ended_names_;
};

}  // namespace drape
