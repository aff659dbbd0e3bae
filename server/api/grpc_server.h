// The listening server: address, credentials, health, reflection, transport limits, shutdown.
#pragma once

#include <grpcpp/server.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/api/tls_files.h"
#include "server/core/status.h"

namespace drape::api {

// What gRPC tells of its own connections and calls (grpc.channelz.v1): of all servers of the
// process that count, on those that serve it.
enum class Channelz { kOff, kCounted, kServed };

struct ServerOptions {
  std::string listen = "127.0.0.1:7743";  // HOST:PORT, port 0 = any free one; or unix:PATH
  std::shared_ptr<TlsInUse> tls = {};     // null: no encryption
  // Needed to listen without TLS on an address that other machines can reach.
  bool allow_insecure = false;
  uint32_t max_request_bytes = 64u << 20;
  // Calls that a connection may have under way; more wait at the client.
  uint32_t max_calls_per_connection = 256;
  // Memory of the transport for all connections: requests that have not arrived wholly, answers
  // that have not been read. Beyond it connections are slowed down, then ended.
  uint64_t max_transport_bytes = uint64_t{2} << 30;
  // A peer that has vanished without a word is noticed after keepalive + timeout.
  std::chrono::milliseconds keepalive{30'000};
  std::chrono::milliseconds keepalive_timeout{10'000};
  // It names addresses of all clients, so it is for operators alone.
  Channelz channelz = Channelz::kOff;
  // Whose health is told, as that of the whole server.
  std::string health_of = "drape.v1.SimulationService";
};

// Only this machine can connect: 127.0.0.0/8, [::1], localhost or unix:PATH.
bool IsLoopback(const std::string& listen);

class GrpcServer {
 public:
  // FAILED_PRECONDITION: INSECURE_ADDRESS, or LISTEN_FAILED when the port is in use. The services
  // outlive the server.
  static Result<std::unique_ptr<GrpcServer>> Start(const ServerOptions& options,
                                                   const std::vector<grpc::Service*>& services);
  // Shuts down without waiting for calls under way.
  ~GrpcServer();

  // Of unix:PATH 1.
  int port() const { return port_; }
  // Calls in this process, for tests.
  std::shared_ptr<grpc::Channel> InProcessChannel();
  // The answer of the health service; SERVING after the start.
  void SetServing(bool is_serving);
  // Refuses new calls, waits for those under way, cancels what is left at the deadline. Returns
  // when no handler runs any more.
  void Shutdown(std::chrono::milliseconds grace);

 private:
  GrpcServer() = default;

  std::string health_of_;
  std::unique_ptr<grpc::Server> server_;
  int port_ = 0;
};

}  // namespace drape::api
