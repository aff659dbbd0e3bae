// What operators ask of a server.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drape/client.h"
#include "drape/v1/admin_service.pb.h"

namespace drape {
inline namespace client {

// A connection to the port of a server for operators (`draped --admin-listen`), or, with the token
// of an operator, to that for its clients. Thread-safe. Errors are drape::Error: kPermissionDenied
// (ADMIN_ONLY) for tenants, kUnauthenticated for others.
class Admin {
 public:
  // `address`: HOST:PORT, or unix:PATH. Errors as Client::Connect.
  static Admin Connect(const std::string& address, const ConnectOptions& options = {});

  Admin(Admin&&) noexcept;
  Admin& operator=(Admin&&) noexcept;
  Admin(const Admin&) = delete;
  Admin& operator=(const Admin&) = delete;
  ~Admin();

  // What each tenant has, by name.
  std::vector<v1::TenantUse> ListTenants() const;
  // All pages, in order of creation.
  std::vector<v1::TenantSession> ListAllSessions() const;
  // Deletes the session with this number (TenantSession.number). Throws kNotFound.
  void DropSession(uint64_t number) const;
  // Ends the server as SIGTERM does. Returns at once.
  void Drain() const;
  // Returns when the files are on the disk. Throws kFailedPrecondition (NO_CHECKPOINTS).
  v1::WriteCheckpointsResponse WriteCheckpoints() const;
  // trace, debug, info, warn, error or off. Returns the former one.
  std::string SetLogLevel(const std::string& level) const;
  // What the server's threads do in the next `duration_s` (0.001 to 60). Throws kAborted
  // (TRACE_IN_PROGRESS).
  v1::RecordTraceResponse RecordTrace(double duration_s) const;

 private:
  struct Impl;
  explicit Admin(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace client
}  // namespace drape
