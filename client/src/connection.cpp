#include "client/src/connection.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <chrono>
#include <utility>

#include "client/src/errors.h"

namespace drape {
inline namespace client {
namespace {

std::chrono::system_clock::time_point After(double seconds) {
  return std::chrono::system_clock::now() +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(
             std::chrono::duration<double>(seconds));
}

bool IsLoopback(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost:") ||
         address.starts_with("[::1]:");
}

}  // namespace

void Connection::Prepare(grpc::ClientContext* context, const std::string& session) const {
  if (options.request_timeout_s > 0) context->set_deadline(After(options.request_timeout_s));
  if (!session.empty()) context->AddMetadata(kSessionHeader, session);
}

std::shared_ptr<Connection> OpenConnection(const std::string& address,
                                           const ConnectOptions& options,
                                           std::shared_ptr<PrivateServer> private_server) {
  auto connection = std::make_shared<Connection>();
  connection->private_server = std::move(private_server);
  connection->address = address;
  connection->options = options;
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(kMaxRequestBytes);
  // A connection of its own: channels of equal arguments would share one otherwise.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A proxy cannot reach a server of this machine.
  if (IsLoopback(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  connection->channel =
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  if (!connection->channel->WaitForConnected(After(options.ready_timeout_s))) {
    throw LocalError(ErrorCode::kUnavailable, "CANNOT_CONNECT",
                     "no Drape server answers at " + address);
  }
  connection->stub = v1::SimulationService::NewStub(connection->channel);
  return connection;
}

}  // namespace client
}  // namespace drape
