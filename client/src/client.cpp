#include "drape/client.h"

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/generic/generic_stub.h>

#include <future>
#include <utility>

#include "client/src/connection.h"
#include "client/src/errors.h"
#include "client/src/private_server.h"
#include "client/src/session_impl.h"

namespace drape {
inline namespace client {
namespace {

using Stub = v1::SimulationService::Stub;

constexpr uint32_t kSessionsPerPage = 1000;

// grpc.health.v1 in terms of messages of equal wire format, because Debian ships no stub for it:
// HealthCheckRequest{string service = 1}, HealthCheckResponse{enum status = 1}, SERVING = 1.
using HealthCheckRequest = google::protobuf::StringValue;
using HealthCheckResponse = google::protobuf::Int32Value;
constexpr int kServing = 1;

}  // namespace

Client::Client(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Client Client::Connect(const std::string& address, const ConnectOptions& options) {
  return Client(OpenConnection(address, options, nullptr));
}

Client Client::SpawnServer(const SpawnOptions& spawn, const ConnectOptions& options) {
  auto server = std::make_shared<PrivateServer>(spawn);
  const std::string address = server->address();
  return Client(OpenConnection(address, options, std::move(server)));
}

const std::string& Client::address() const {
  return connection_->address;
}

v1::ServerInfo Client::GetServerInfo() const {
  return connection_->Call(*connection_->stub, &Stub::GetServerInfo, v1::GetServerInfoRequest());
}

Health Client::CheckHealth(const std::string& service) const {
  grpc::TemplatedGenericStub<HealthCheckRequest, HealthCheckResponse> stub(connection_->channel);
  HealthCheckRequest request;
  request.set_value(service);
  HealthCheckResponse response;
  connection_->Send({}, Twice::kReadsAgain, [&](grpc::ClientContext* context) {
    std::promise<grpc::Status> done;
    stub.UnaryCall(context, "/grpc.health.v1.Health/Check", grpc::StubOptions(), &request,
                   &response, [&done](grpc::Status status) { done.set_value(std::move(status)); });
    return done.get_future().get();
  });
  return response.value() == kServing ? Health::kServing : Health::kNotServing;
}

Session Client::CreateSession(const SessionOptions& options) const {
  v1::CreateSessionRequest request;
  if (options.ttl_s) request.set_ttl_s(*options.ttl_s);
  request.set_display_name(options.display_name);
  const v1::Session session = connection_->Call(*connection_->stub, &Stub::CreateSession, request);
  return Session(std::make_unique<Session::Impl>(connection_, session,
                                                 /*is_owner=*/true, options.renews_lease));
}

Session Client::AttachSession(const std::string& name) const {
  v1::GetSessionRequest request;
  request.set_name(name);
  const v1::Session session =
      connection_->Call(*connection_->stub, &Stub::GetSession, request, {name});
  return Session(std::make_unique<Session::Impl>(connection_, session,
                                                 /*is_owner=*/false, /*renews_lease=*/false));
}

std::vector<v1::Session> Client::ListSessions() const {
  std::vector<v1::Session> sessions;
  v1::ListSessionsRequest request;
  request.set_page_size(kSessionsPerPage);
  do {
    const auto page = connection_->Call(*connection_->stub, &Stub::ListSessions, request);
    sessions.insert(sessions.end(), page.sessions().begin(), page.sessions().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return sessions;
}

}  // namespace client
}  // namespace drape
