// The implementation of drape::Session: its name, its connection and the thread that renews its
// lease.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "client/src/connection.h"
#include "drape/session.h"

namespace drape {
inline namespace client {

struct Session::Impl {
  Impl(std::shared_ptr<Connection> shared_connection, const v1::Session& session, bool is_owned,
       bool renews_lease);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // `timeout_s` 0: that of the connection.
  grpc::Status Renew(double timeout_s, v1::Session* session) const;
  grpc::Status Delete(double timeout_s) const;
  void StopRenewing();
  // Of requests about what the session holds.
  SessionRoute Route() const;

  const std::shared_ptr<Connection> connection;
  const std::string name;
  const double ttl_s;
  bool is_owner;

  mutable std::mutex mutex;
  std::condition_variable wake;      // renewing changed
  bool is_renewing = false;          // guarded by mutex
  std::optional<Error> lease_error;  // guarded by mutex
  std::string incarnation;           // of the server that holds it; guarded by mutex
  std::thread renewal;

 private:
  void RenewLoop();
};

}  // namespace client
}  // namespace drape
