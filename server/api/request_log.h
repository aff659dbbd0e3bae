// How requests end, at debug level: for whom, and which of theirs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/api/authentication.h"
#include "server/core/status.h"

namespace drape::api {

// What the log says of a request besides its end. Empty, and free, unless debug lines are written.
// Copies are cheap.
class RequestTag {
 public:
  RequestTag() = default;
  // The tenant, and `session` (or `name`) and `request_id` of those requests that have them.
  template <class Request>
  RequestTag(const Caller& caller, const Request& request) {
    if (!IsWanted()) return;
    std::string session, request_id;
    if constexpr (requires { request.session(); }) {
      session = request.session();
    } else if constexpr (requires { request.name(); }) {
      session = request.name();
    }
    if constexpr (requires { request.request_id(); }) request_id = request.request_id();
    Begin(Request::descriptor()->name(), caller.tenant, session, request_id);
  }

  // A stream that begins with this message of `method`.
  template <class Message>
  RequestTag(const std::string& method, const Caller& caller, const Message& message) {
    if (!IsWanted()) return;
    std::string request_id;
    if constexpr (requires { message.request_id(); }) request_id = message.request_id();
    Begin(method, caller.tenant, message.session(), request_id);
  }

  // One line: request method=Step tenant=lab session=... request_id=... code=OK ms=1.5
  void Log(const Status& status) const;

 private:
  struct Text;

  static bool IsWanted();
  void Begin(const std::string& method, const std::string& tenant, const std::string& session,
             const std::string& request_id);

  std::shared_ptr<const Text> text_;
};

}  // namespace drape::api
