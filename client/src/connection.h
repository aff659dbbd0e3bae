// State shared by a Client and its sessions.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <memory>
#include <string>

#include "drape/client.h"
#include "drape/v1/simulation_service.grpc.pb.h"

namespace drape {
inline namespace client {

class PrivateServer;

// Largest request; answers are bounded by the server.
inline constexpr int kMaxRequestBytes = 64 * 1024 * 1024;
// Routes a request to the server that holds the session.
inline constexpr char kSessionHeader[] = "x-drape-session";

// Immutable after construction, so thread-safe. Destroyed in reverse order: first the channel, then
// the private server.
struct Connection {
  std::shared_ptr<PrivateServer> private_server;  // null when connected to a running server
  std::string address;
  ConnectOptions options;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SimulationService::Stub> stub;

  // Prepares the context of a unary request: deadline, and the routing header when `session` is
  // not empty.
  void Prepare(grpc::ClientContext* context, const std::string& session) const;
  // For the context of a stream, too.
  void AddToken(grpc::ClientContext* context) const;
};

// Waits until the channel is ready; throws kUnavailable after the timeout.
std::shared_ptr<Connection> OpenConnection(const std::string& address,
                                           const ConnectOptions& options,
                                           std::shared_ptr<PrivateServer> private_server);

}  // namespace client
}  // namespace drape
