// Who calls: the tenant of the token that a call carries, or of the certificate of its connection.
#pragma once

#include <grpcpp/server_context.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/api/token_file.h"
#include "server/core/clock.h"

namespace drape::api {

// The tenant, or why the call is refused. The tenant is empty on a server without tokens.
struct Caller {
  std::string tenant{};
  bool is_refused = false;
  // TokenFile::HashOf; empty without tokens.
  std::string token_hash{};
  // The run of the server that the caller knows; empty: any.
  std::string incarnation{};
  // When the client stops waiting, by the clock of the server.
  int64_t deadline_us = std::numeric_limits<int64_t>::max();
  // kHalfCloseHeader.
  bool half_closes = false;
};

// The deadline of a call; that of a stream is that of each of its requests.
int64_t DeadlineOf_us(const grpc::CallbackServerContext& context, const Clock& clock);

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
  // Whether a caller who was identified would be let in again: its token may have been taken away.
  bool IsValid(const Caller& caller) const;
  // Whether the call carries the token of an operator, who is no tenant.
  bool IsOperator(const grpc::CallbackServerContext& context) const;
  bool has_tokens() const;
  // TokenFile::tenants.
  std::set<std::string> tenants() const;
  // TokenFile::rates, TokenFile::builder_rates, TokenFile::weights.
  std::unordered_map<std::string, double> rates() const;
  std::unordered_map<std::string, double> builder_rates() const;
  std::unordered_map<std::string, uint32_t> weights() const;

 private:
  std::shared_ptr<const TokenFile> tokens() const;

  bool by_certificate_ = false;
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenFile> tokens_;  // null: none are needed
};

// UNAUTHENTICATED (INVALID_TOKEN). It says no more, and is the same whatever was called.
grpc::Status Unauthenticated();
// The same for a call that had one when it began.
Status TokenTakenAway();
// PERMISSION_DENIED (ADMIN_ONLY).
grpc::Status AdminOnly();

}  // namespace drape::api
