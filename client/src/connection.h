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
// Another run of the server than this one refuses the request.
inline constexpr char kIncarnationHeader[] = "x-drape-incarnation";

// The session of a request, and the run of the server that is meant; empty: none, any.
struct SessionRoute {
  std::string session;
  std::string incarnation = {};
};

// Immutable after construction, so thread-safe. Destroyed in reverse order: first the channel, then
// the private server.
struct Connection {
  std::shared_ptr<PrivateServer> private_server;  // null when connected to a running server
  std::string address;
  ConnectOptions options;
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<v1::SimulationService::Stub> stub;

  // Prepares the context of a unary request: deadline, token and the headers of the route.
  void Prepare(grpc::ClientContext* context, const SessionRoute& route) const;
  // The same without a deadline, for the context of a stream.
  void AddHeaders(grpc::ClientContext* context, const SessionRoute& route) const;
};

// Waits until the channel is ready; throws kUnavailable after the timeout.
std::shared_ptr<Connection> OpenConnection(const std::string& address,
                                           const ConnectOptions& options,
                                           std::shared_ptr<PrivateServer> private_server);

}  // namespace client
}  // namespace drape
