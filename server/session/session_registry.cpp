#include "server/session/session_registry.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/random.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "server/core/check.h"
#include "server/core/text.h"
#include "server/core/violations.h"
#include "server/session/page_token.h"

namespace drape {
namespace {

constexpr size_t kTokenBytes = 16;  // 128 random bits
constexpr size_t kShownDigits = 4;  // of a token in lists
// Sessions that come and go quickly would fill the log.
constexpr uint32_t kMaxLogLinesPerSecond = 20;

std::string RandomBytes(size_t count) {
  std::string bytes(count, '\0');
  DRAPE_CHECK(getrandom(bytes.data(), count, 0) == static_cast<ssize_t>(count),
              "no random numbers");
  return bytes;
}

constexpr char kSessionLost[] = "SESSION_LOST";

Status ExpiredStatus(bool may_be_kept) {
  return {StatusCode::kNotFound, "SESSION_EXPIRED",
          may_be_kept ? "the session has expired; its cloths are deleted here, and the server may "
                        "have kept them in a file that its operator can restore"
                      : "the session has expired; its cloths are deleted"};
}

// Where the numbers of sessions begin: one that an operator read in another run of the server is as
// good as never that of a session here.
uint64_t RandomNumber() {
  uint32_t number = 0;
  std::memcpy(&number, RandomBytes(sizeof(number)).data(), sizeof(number));
  return uint64_t{1} + number;
}

// " tenant=lab"; empty where there are no tenants. Their names need no quotes.
std::string TenantField(const std::string& tenant) {
  return tenant.empty() ? "" : " tenant=" + tenant;
}

}  // namespace

std::string ShortSessionName(const std::string& name) {
  const size_t dash = name.rfind('-');
  if (dash == std::string::npos) return name;
  return name.substr(0, dash + 1 + kShownDigits) + "...";
}

SessionLease::SessionLease(SessionLease&& other) noexcept
    : registry_(std::exchange(other.registry_, nullptr)), session_(std::move(other.session_)) {}

SessionLease& SessionLease::operator=(SessionLease&& other) noexcept {
  if (this == &other) return *this;
  Release();
  registry_ = std::exchange(other.registry_, nullptr);
  session_ = std::move(other.session_);
  return *this;
}

SessionLease::~SessionLease() {
  Release();
}

void SessionLease::Release() {
  if (session_ != nullptr) registry_->EndLease(*session_);
  session_ = nullptr;
  registry_ = nullptr;
}

SessionRegistry::SessionRegistry(Scheduler& scheduler, const SessionLimits& limits,
                                 const Clock& clock, std::string server_id, bool has_lasting_id)
    : clock_(clock),
      server_id_(std::move(server_id)),
      has_lasting_id_(has_lasting_id),
      log_limit_(kMaxLogLinesPerSecond),
      commons_(std::make_shared<SessionCommons>(scheduler, limits, clock)),
      next_creation_number_(RandomNumber()) {}

void SessionRegistry::LogEvent(const std::string& line) {
  const LogLimit::Verdict verdict = log_limit_.Ask(clock_.NowUs());
  if (verdict.left_out > 0) spdlog::info("session_events_left_out count={}", verdict.left_out);
  if (verdict.is_admitted) spdlog::info("{}", line);
}

Result<SessionLease> SessionRegistry::Create(std::optional<double> ttl_s,
                                             const std::string& display_name,
                                             const std::string& tenant) {
  const double ttl = ttl_s.value_or(kDefaultTtl_s);
  Violations violations;
  violations.InRange("ttl_s", ttl, {kMinTtl_s, kMaxTtl_s, "s"});
  violations.Require(display_name.size() <= kMaxDisplayNameBytes, "display_name", [&] {
    return "has " + std::to_string(display_name.size()) + " bytes; at most " +
           std::to_string(kMaxDisplayNameBytes);
  });
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  if (commons_->scheduler.is_draining()) return DrainingStatus();

  const std::string name = "sessions/" + server_id_ + "-" + HexOf(RandomBytes(kTokenBytes));
  const std::lock_guard lock(mutex_);
  DRAPE_ASSIGN_OR_RETURN(SessionLease lease, Insert(std::make_shared<Session>(
                                                 commons_, name, display_name, ttl, tenant)));
  LogEvent(fmt::format("session_created name={}{} ttl_s={}", ShortSessionName(name),
                       TenantField(tenant), ttl));
  return lease;
}

Result<SessionLease> SessionRegistry::Insert(std::shared_ptr<Session> session) {
  if (sessions_.size() >= commons_->limits.max_sessions) {
    return Status(StatusCode::kResourceExhausted, "TOO_MANY_SESSIONS",
                  "max_sessions is " + std::to_string(commons_->limits.max_sessions));
  }
  DRAPE_RETURN_IF_ERROR(commons_->tenants.Take(session->tenant(), {1, 0, 0}));
  Entry entry;
  entry.session = session;
  entry.creation_number = next_creation_number_++;
  entry.number_of_tenant = ++last_number_of_tenant_[session->tenant()];
  entry.under_way = 1;
  RenewEntry(entry);
  names_by_creation_.emplace(entry.creation_number, session->name());
  sessions_.emplace(session->name(), std::move(entry));
  return SessionLease(this, std::move(session));
}

Result<SessionLease> SessionRegistry::Return(FormerSession former) {
  constexpr size_t kMaxNameBytes = 256;
  Violations violations;
  violations.InRange("ttl_s", former.ttl_s, {kMinTtl_s, kMaxTtl_s, "s"});
  violations.Require(former.display_name.size() <= kMaxDisplayNameBytes, "display_name",
                     [] { return "is too long"; });
  violations.Require(former.name.starts_with("sessions/") && former.name.size() <= kMaxNameBytes,
                     "name", [] { return "is no name of a session"; });
  // ClothTable counts from there without a wrap.
  const ClothId origin = former.issued.origin;
  violations.Require(std::max(origin.slot, origin.generation) <= INT32_MAX, "id_origin",
                     [] { return "is no origin of ids"; });
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  ++former.issued.returns;
  const std::lock_guard lock(mutex_);
  if (sessions_.contains(former.name)) {
    return Status::InvalidField("name", "is the name of another session, too");
  }
  return Insert(std::make_shared<Session>(commons_, former.name, former.display_name, former.ttl_s,
                                          former.tenant, std::move(former.issued),
                                          former.checkpoint_unix_s));
}

std::vector<std::shared_ptr<Session>> SessionRegistry::All() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<Session>> all;
  for (const auto& [number, name] : names_by_creation_) all.push_back(sessions_.at(name).session);
  return all;
}

bool SessionRegistry::IsExpired(const Entry& entry, int64_t now_us) const {
  return entry.under_way == 0 && now_us >= entry.expires_us;
}

void SessionRegistry::RenewEntry(Entry& entry) {
  entry.expires_us = clock_.NowUs() + static_cast<int64_t>(entry.session->ttl_s() * 1e6);
}

Status SessionRegistry::CheckLive(const std::string& name, const std::string& tenant) const {
  const auto found = sessions_.find(name);
  const bool exists = found != sessions_.end() && found->second.session->tenant() == tenant;
  if (exists && !IsExpired(found->second, clock_.NowUs())) return Status::Ok();
  if (exists) return ExpiredStatus(before_expiry_ != nullptr);
  const auto ended = ended_names_.find(name);
  if (ended != ended_names_.end() && ended->second.tenant == tenant) return ended->second.answer;
  constexpr std::string_view kPrefix = "sessions/";
  if (has_lasting_id_ && name.starts_with(kPrefix) &&
      !name.substr(kPrefix.size()).starts_with(server_id_ + "-")) {
    return {StatusCode::kNotFound, "WRONG_SERVER",
            "the session belongs to another server than '" + server_id_ + "'"};
  }
  return {StatusCode::kNotFound, "SESSION_NOT_FOUND", "no such session"};
}

Result<SessionLease> SessionRegistry::Find(const std::string& name, const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  DRAPE_RETURN_IF_ERROR(CheckLive(name, tenant));
  Entry& entry = sessions_.at(name);
  ++entry.under_way;
  RenewEntry(entry);
  return SessionLease(this, entry.session);
}

void SessionRegistry::EndLease(const Session& session) {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(session.name());
  if (found == sessions_.end()) return;  // deleted while the request was under way
  --found->second.under_way;
  RenewEntry(found->second);
}

SessionView SessionRegistry::ViewOf(const Entry& entry, int64_t now_us) const {
  SessionView view;
  view.number = entry.creation_number;
  view.tenant = entry.session->tenant();
  view.name = entry.session->name();
  view.display_name = entry.session->display_name();
  view.ttl_s = entry.session->ttl_s();
  view.remaining_s =
      entry.under_way > 0
          ? view.ttl_s
          : static_cast<double>(std::max<int64_t>(0, entry.expires_us - now_us)) / 1e6;
  view.cloth_count = entry.session->cloth_count();
  view.particle_count = entry.session->particle_count();
  return view;
}

Result<SessionView> SessionRegistry::Get(const std::string& name, const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  DRAPE_RETURN_IF_ERROR(CheckLive(name, tenant));
  return ViewOf(sessions_.at(name), clock_.NowUs());
}

Result<SessionView> SessionRegistry::Renew(const std::string& name, const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  DRAPE_RETURN_IF_ERROR(CheckLive(name, tenant));
  Entry& entry = sessions_.at(name);
  RenewEntry(entry);
  return ViewOf(entry, clock_.NowUs());
}

Result<SessionPage> SessionRegistry::List(uint32_t page_size, const std::string& page_token,
                                          const std::string& tenant) const {
  return ListOf(page_size, page_token, &tenant);
}

Result<SessionPage> SessionRegistry::ListAll(uint32_t page_size,
                                             const std::string& page_token) const {
  return ListOf(page_size, page_token, nullptr);
}

Result<SessionPage> SessionRegistry::ListOf(uint32_t page_size, const std::string& page_token,
                                            const std::string* tenant) const {
  DRAPE_ASSIGN_OR_RETURN(const uint64_t after, ParsePageToken(page_token));
  const uint32_t size = EffectivePageSize(page_size);
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  SessionPage page;
  uint64_t last = 0;
  for (const auto& [creation_number, name] : names_by_creation_) {
    const Entry& entry = sessions_.at(name);
    if (tenant != nullptr && entry.session->tenant() != *tenant) continue;
    // A tenant must not learn from tokens how many sessions others make.
    const uint64_t number = tenant != nullptr ? entry.number_of_tenant : creation_number;
    if (number <= after || IsExpired(entry, now_us)) continue;
    if (page.sessions.size() == size) {
      page.next_page_token = MakePageToken(last);
      break;
    }
    page.sessions.push_back(ViewOf(entry, now_us));
    last = number;
  }
  return page;
}

void SessionRegistry::Remove(const std::string& name) {
  const auto found = sessions_.find(name);
  names_by_creation_.erase(found->second.creation_number);
  commons_->tenants.GiveBack(found->second.session->tenant(), {1, 0, 0});
  sessions_.erase(found);
}

void SessionRegistry::RememberEnded(const std::string& name, const std::string& tenant,
                                    const Status& answer) {
  if (!ended_names_.emplace(name, Ended{tenant, answer}).second) return;
  ended_.push_back(name);
  while (ended_.size() > commons_->limits.max_ended_names) {
    ended_names_.erase(ended_.front());
    ended_.pop_front();
  }
}

void SessionRegistry::RememberLost(const std::string& name, const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  RememberEnded(name, tenant,
                {StatusCode::kNotFound, kSessionLost,
                 "the session was lost with the device or the process that held it; create it "
                 "again"});
}

void SessionRegistry::Delete(const std::string& name, std::function<void(Status)> done,
                             const std::string& tenant) {
  Status status;
  std::shared_ptr<Session> session;
  const bool is_draining = commons_->scheduler.is_draining();
  {
    const std::lock_guard lock(mutex_);
    status = CheckLive(name, tenant);
    // It may be in the last checkpoint, and come back.
    if (status.ok() && is_draining) status = DrainingStatus();
    if (status.ok()) {
      session = sessions_.at(name).session;
      Remove(name);
    }
  }
  if (!status.ok()) {
    done(status);
    return;
  }
  LogEvent(fmt::format("session_deleted name={}{}", ShortSessionName(name), TenantField(tenant)));
  session->Close(std::move(done));
}

void SessionRegistry::Drop(uint64_t number, std::function<void(Status)> done) {
  std::string name, tenant;
  {
    const std::lock_guard lock(mutex_);
    const auto found = names_by_creation_.find(number);
    if (found != names_by_creation_.end()) {
      name = found->second;
      tenant = sessions_.at(name).session->tenant();
    }
  }
  if (name.empty()) {
    return done({StatusCode::kNotFound, "SESSION_NOT_FOUND",
                 "no session has the number " + std::to_string(number)});
  }
  // What an operator did is never left out.
  const std::string line = fmt::format("session_dropped name={}{} by=operator",
                                       ShortSessionName(name), TenantField(tenant));
  const auto log = [line, done = std::move(done)](const Status& status) {
    if (status.ok()) spdlog::info("{}", line);
    done(status);
  };
  Delete(name, log, tenant);
}

std::vector<std::pair<std::string, std::string>> SessionRegistry::LostNames() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::pair<std::string, std::string>> names;
  for (const std::string& name : ended_) {
    const Ended& ended = ended_names_.at(name);
    if (ended.answer.reason() == kSessionLost) names.emplace_back(name, ended.tenant);
  }
  return names;
}

size_t SessionRegistry::ReapExpired() {
  std::vector<std::shared_ptr<Session>> expired;
  // Its ids take from what all sessions may have.
  for (const auto& session : All()) session->request_memory().ForgetOld();
  {
    const std::lock_guard lock(mutex_);
    const int64_t now_us = clock_.NowUs();
    for (const auto& [name, entry] : sessions_) {
      if (IsExpired(entry, now_us)) expired.push_back(entry.session);
    }
  }
  // Nobody can renew them any longer.
  for (const auto& session : expired) {
    if (before_expiry_) before_expiry_(session);
  }
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(expired,
                  [&](const auto& session) { return !sessions_.contains(session->name()); });
    for (const auto& session : expired) {
      Remove(session->name());
      RememberEnded(session->name(), session->tenant(), ExpiredStatus(before_expiry_ != nullptr));
    }
  }
  for (const auto& session : expired) {
    LogEvent(fmt::format("session_expired name={}{} cloths={}", ShortSessionName(session->name()),
                         TenantField(session->tenant()), session->cloth_count()));
    session->Close([](const Status&) {});
  }
  return expired.size();
}

ServerTotals SessionRegistry::TotalsOfAll() const {
  const std::lock_guard lock(mutex_);
  ServerTotals totals;
  for (const auto& [name, entry] : sessions_) {
    ++totals.session_count;
    totals.cloth_count += entry.session->cloth_count();
    totals.particle_count += entry.session->particle_count();
  }
  return totals;
}

std::map<std::string, TenantTotals> SessionRegistry::TotalsByTenant() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, TenantTotals> by_tenant;
  for (const auto& [name, entry] : sessions_) {
    TenantTotals& tenant = by_tenant[entry.session->tenant()];
    ++tenant.totals.session_count;
    tenant.totals.cloth_count += entry.session->cloth_count();
    tenant.totals.particle_count += entry.session->particle_count();
    const bool is_own = entry.session->tenant().empty();  // each session is an owner
    if (is_own || tenant.owners.empty()) tenant.owners.push_back(entry.session->owner());
  }
  return by_tenant;
}

ServerTotals SessionRegistry::Totals(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  ServerTotals totals;
  for (const auto& [name, entry] : sessions_) {
    if (entry.session->tenant() != tenant) continue;
    ++totals.session_count;
    totals.cloth_count += entry.session->cloth_count();
    totals.particle_count += entry.session->particle_count();
  }
  return totals;
}

}  // namespace drape
