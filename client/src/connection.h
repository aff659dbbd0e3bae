// State shared by a Client and its sessions.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <functional>
#include <memory>
#include <string>

#include "client/src/retries.h"
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
  std::unique_ptr<RetryBudget> budget;
  std::unique_ptr<RequestIds> request_ids;

  // Token and the headers of the route.
  void AddHeaders(grpc::ClientContext* context, const SessionRoute& route) const;

  // Sends a request by `once`, which gets a context with its deadline, and again while retries.h
  // and the deadline allow it. Throws what it ends with. `limit_s` [s]: of all tries together, if
  // that is less than the limit of the connection; 0: none.
  void Send(const SessionRoute& route, Twice twice,
            const std::function<grpc::Status(grpc::ClientContext*)>& once,
            double limit_s = 0) const;

  // The same for one request with one answer, of a service of this connection.
  template <class Stub, class Request, class Response>
  Response Call(Stub& of,
                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request, const SessionRoute& route = {}, double limit_s = 0) const {
    Response response;
    Send(
        route, IfSentTwice(request),
        [&](grpc::ClientContext* context) { return (of.*method)(context, request, &response); },
        limit_s);
    return response;
  }
};

// Waits until the channel is ready; throws kUnavailable after the timeout.
std::shared_ptr<Connection> OpenConnection(const std::string& address,
                                           const ConnectOptions& options,
                                           std::shared_ptr<PrivateServer> private_server);

}  // namespace client
}  // namespace drape
