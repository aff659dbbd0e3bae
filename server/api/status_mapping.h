// The one table from Drape's Status to grpc::Status with google.rpc.Status details.
#pragma once

#include <grpcpp/support/status.h>

#include <cstddef>
#include <map>
#include <string>

#include "server/core/status.h"

namespace drape::api {

inline constexpr char kErrorDomain[] = "drape";
// Trailers must stay below gRPC's default metadata limit of 8 KiB. The message travels twice: in
// the details, and percent-encoded, up to threefold, as grpc-message. Longer texts are cut, and
// violations beyond the limit are left out: 4 * 1000 + 3000 bytes leave room for the rest.
inline constexpr size_t kMaxMessageBytes = 1000;
inline constexpr size_t kMaxViolationTextBytes = 200;
inline constexpr size_t kMaxBadRequestBytes = 3000;

grpc::StatusCode ToGrpcCode(StatusCode code);

// Below the transport there is no UNAUTHENTICATED: ToGrpcStatus maps this reason to it.
inline constexpr char kInvalidToken[] = "INVALID_TOKEN";

// Pure. OK gives OK. Otherwise the details hold ErrorInfo{reason, domain "drape"}, BadRequest when
// there are violations, QuotaFailure for RESOURCE_EXHAUSTED, and RetryInfo where waiting helps.
// `metadata`: of ErrorInfo, a few short values for programs.
using StatusMetadata = std::map<std::string, std::string>;
grpc::Status ToGrpcStatus(const Status& status, const StatusMetadata& metadata = {});

// The end of a call whose client has gone or does not want its answer any more.
Status ClientHasGone();

}  // namespace drape::api
