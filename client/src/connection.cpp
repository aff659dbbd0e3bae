#include "client/src/connection.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "client/src/errors.h"
#include "client/src/heap_thresholds.h"
#include "client/src/private_server.h"

namespace drape {
inline namespace client {
namespace {

constexpr double kReasonTimeout_s = 1;
// Between attempts to reach a server that is away: one that starts again takes a second or two.
constexpr int kFirstReconnect_ms = 100;
constexpr int kReconnect_ms = 2'000;

int Milliseconds(double seconds) {
  return static_cast<int>(std::clamp(seconds * 1000, 1.0, 1e9));
}

std::chrono::system_clock::time_point After(double seconds) {
  return std::chrono::system_clock::now() +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(
             std::chrono::duration<double>(seconds));
}

bool IsLoopback(const std::string& address) {
  return address.starts_with("127.") || address.starts_with("localhost:") ||
         address.starts_with("[::1]:");
}

std::string ReadPem(const std::filesystem::path& path) {
  std::ifstream file;
  std::error_code ignored;  // a missing file is not a regular file either
  if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
  std::string pem(std::istreambuf_iterator<char>(file), {});
  if (file.is_open() && !file.bad() && !pem.empty()) return pem;
  throw LocalError(ErrorCode::kFailedPrecondition, "TLS_FILE_FAILED",
                   "'" + path.string() + "' cannot be read or is empty");
}

std::shared_ptr<grpc::ChannelCredentials> Credentials(const std::optional<TlsOptions>& tls) {
  if (!tls) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  if (!tls->authorities_file.empty()) ssl.pem_root_certs = ReadPem(tls->authorities_file);
  if (!tls->certificate_file.empty() || !tls->key_file.empty()) {
    ssl.pem_cert_chain = ReadPem(tls->certificate_file);
    ssl.pem_private_key = ReadPem(tls->key_file);
  }
  return grpc::SslCredentials(ssl);
}

// The reason why a channel does not come up, as gRPC gives it to the first request.
std::string WhyNot(v1::SimulationService::Stub& stub) {
  grpc::ClientContext context;
  context.set_deadline(After(kReasonTimeout_s));
  v1::ServerInfo info;
  return stub.GetServerInfo(&context, v1::GetServerInfoRequest(), &info).error_message();
}

}  // namespace

void Connection::AddHeaders(grpc::ClientContext* context, const SessionRoute& route) const {
  if (!route.session.empty()) context->AddMetadata(kSessionHeader, route.session);
  if (!route.incarnation.empty()) context->AddMetadata(kIncarnationHeader, route.incarnation);
  if (!options.token.empty()) context->AddMetadata("authorization", "Bearer " + options.token);
}

void Connection::Send(const SessionRoute& route, Twice twice,
                      const std::function<grpc::Status(grpc::ClientContext*)>& once,
                      double limit_s) const {
  auto deadline = std::chrono::system_clock::time_point::max();
  for (const double limit : {options.request_timeout_s, limit_s}) {
    if (limit > 0) deadline = std::min(deadline, After(limit));
  }
  Tries tries(options.retries, *budget, twice);
  while (true) {
    grpc::ClientContext context;
    AddHeaders(&context, route);
    context.set_deadline(deadline);
    const grpc::Status status = once(&context);
    if (status.ok()) return budget->Refill();
    ErrorDetails details = DecodeStatus(status);
    details.unanswered_tries = tries.unanswered();
    const bool is_over = private_server != nullptr && private_server->has_ended();
    const auto pause = is_over ? std::nullopt : tries.PauseAfter(details);
    if (!pause || std::chrono::system_clock::now() + *pause >= deadline) {
      if (tries.IsInDoubt(details)) details.message += "; it may have been done";
      Throw(std::move(details));
    }
    std::this_thread::sleep_for(*pause);
  }
}

std::shared_ptr<Connection> OpenConnection(const std::string& address,
                                           const ConnectOptions& options,
                                           std::shared_ptr<PrivateServer> private_server) {
  RaiseHeapThresholds();
  auto connection = std::make_shared<Connection>();
  connection->private_server = std::move(private_server);
  connection->address = address;
  connection->options = options;
  connection->budget = std::make_unique<RetryBudget>(options.retries.budget);
  connection->request_ids = std::make_unique<RequestIds>();
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(kMaxRequestBytes);
  // A server that has vanished without a word is noticed while a call is under way.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, Milliseconds(options.keepalive_s));
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, Milliseconds(options.keepalive_timeout_s));
  // A silent stream sends nothing but pings; by default the third one would wait for something else
  // to be sent.
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnect_ms);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kReconnect_ms);
  // A connection of its own: channels of equal arguments would share one otherwise.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // A proxy cannot reach a server of this machine.
  if (IsLoopback(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  if (options.tls && !options.tls->server_name.empty()) {
    arguments.SetSslTargetNameOverride(options.tls->server_name);
  }
  connection->channel = grpc::CreateCustomChannel(address, Credentials(options.tls), arguments);
  connection->stub = v1::SimulationService::NewStub(connection->channel);
  if (!connection->channel->WaitForConnected(After(options.ready_timeout_s))) {
    throw LocalError(ErrorCode::kUnavailable, "CANNOT_CONNECT",
                     "no Drape server answers at " + address +
                         (options.tls ? " over TLS: " : " without TLS: ") +
                         WhyNot(*connection->stub));
  }
  return connection;
}

}  // namespace client
}  // namespace drape
