// Who calls: the tenant of the token that a call carries.
#pragma once

#include <grpcpp/server_context.h>

#include <memory>
#include <mutex>
#include <string>

#include "server/api/token_file.h"

namespace drape::api {

// The tenant, or why the call is refused. The tenant is empty on a server without tokens.
struct Caller {
  std::string tenant{};
  bool is_refused = false;
};

// Thread-safe.
class Authentication {
 public:
  // Without tokens: everybody is let in, and there are no tenants.
  Authentication() = default;
  explicit Authentication(TokenFile tokens);

  // From now on; sessions stay with their tenants. Only of a server that has tokens.
  void Replace(TokenFile tokens);

  // By the metadata `authorization: Bearer TOKEN`.
  Caller Identify(const grpc::CallbackServerContext& context) const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenFile> tokens_;  // null: none are needed
};

// UNAUTHENTICATED (INVALID_TOKEN). It says no more, and is the same whatever was called.
grpc::Status Unauthenticated();

}  // namespace drape::api
