// Limits the open streams of gRPC's own services, which need no token: health and reflection.
#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <vector>

namespace drape::api {

// Of one connection, and of all; an address has at most as many as it leaves free
// (core/session_permits.h). An idle one takes about 17 kB (by hand), and nothing else counts it.
inline constexpr uint32_t kStrangerStreamsPerConnection = 16;
inline constexpr uint32_t kStrangerStreams = 1024;

// For ServerBuilder: streams of services that are not ours are cancelled beyond the limits.
std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>>
LimitStrangerStreams();

}  // namespace drape::api
