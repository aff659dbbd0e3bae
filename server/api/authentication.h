// Who calls: the tenant of the token that a call carries, or of the certificate of its connection.
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
  // The run of the server that the caller knows; empty: any.
  std::string incarnation{};
};

// Thread-safe.
class Authentication {
 public:
  // Everybody is let in, and there are no tenants.
  Authentication() = default;
  explicit Authentication(TokenFile tokens);

  // The tenant is the common name of the client's certificate, which the transport has verified.
  static std::shared_ptr<Authentication> ByCertificate();

  // From now on; sessions stay with their tenants. Only of a server that has tokens.
  void Replace(TokenFile tokens);

  // By the metadata `authorization: Bearer TOKEN`, or by the certificate.
  Caller Identify(const grpc::CallbackServerContext& context) const;
  bool has_tokens() const;

 private:
  std::shared_ptr<const TokenFile> tokens() const;

  bool by_certificate_ = false;
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenFile> tokens_;  // null: none are needed
};

// UNAUTHENTICATED (INVALID_TOKEN). It says no more, and is the same whatever was called.
grpc::Status Unauthenticated();

}  // namespace drape::api
