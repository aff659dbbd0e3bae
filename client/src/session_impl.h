// The implementation of drape::Session: its name, its connection and the thread that renews its
// lease.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
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

  // These throw. `timeout_s` 0: that of the connection.
  v1::Session Renew(double timeout_s) const;
  void Delete(double timeout_s) const;
  void StopRenewing();
  // Of requests about what the session holds.
  SessionRoute Route() const;

  // Connection::Send for what the session holds: an error says what is lost with it.
  void Send(Twice twice, const std::function<grpc::Status(grpc::ClientContext*)>& once) const;

  // Gives a request an id, if it has none and the options want that.
  template <class Request>
  void GiveId(Request* request) const {
    if (!connection->options.retries.gives_request_ids || !request->request_id().empty()) return;
    request->set_request_id(connection->request_ids->Next());
  }

  // One request about what the session holds, which is filled in.
  template <class Request, class Response>
  Response Call(grpc::Status (v1::SimulationService::Stub::*method)(grpc::ClientContext*,
                                                                    const Request&, Response*),
                Request request) const {
    request.set_session(name);
    if constexpr (requires { request.request_id(); }) GiveId(&request);
    Response response;
    Send(IfSentTwice(request), [&](grpc::ClientContext* context) {
      return (*connection->stub.*method)(context, request, &response);
    });
    return response;
  }

  States Read(v1::ReadStatesRequest request) const;
  // The bytes of what was saved by this name.
  std::string Export(const std::string& saved_name) const;

  const std::shared_ptr<Connection> connection;
  const std::string name;
  const double ttl_s;
  bool is_owner;
  // The highest step of the last answer to a Step; also its streams know it.
  const std::shared_ptr<std::atomic<uint64_t>> told_step =
      std::make_shared<std::atomic<uint64_t>>(0);

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
