#include "server/api/grpc_server.h"

#include <grpcpp/ext/channelz_service_plugin.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <grpcpp/server_builder.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string_view>
#include <utility>

#include "server/api/stranger_streams.h"

namespace drape::api {
namespace {

// Shortest time between two pings of a client that sends nothing else [ms].
constexpr int kLeastPing_ms = 10'000;
// Between two looks at the files of certificates and keys [s].
constexpr unsigned kReadAgain_s = 2;

constexpr std::string_view kUnix = "unix:";

Status CannotListen(const std::string& listen, const std::string& why) {
  return {StatusCode::kFailedPrecondition, "LISTEN_FAILED",
          "cannot listen on " + listen + ": " + why};
}

bool SomebodyAnswers(const sockaddr_un& address) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return false;
  const bool answers =
      connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 ||
      errno == EAGAIN;  // it has more to accept than it can keep
  close(socket);
  return answers;
}

// gRPC would take the path away from a server that listens on it.
Status CheckUnixPath(const std::string& listen) {
  namespace fs = std::filesystem;
  if (!listen.starts_with(kUnix)) return Status::Ok();
  const std::string path = listen.substr(kUnix.size());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return CannotListen(listen, "a path has 1 to " + std::to_string(sizeof(address.sun_path) - 1) +
                                    " bytes, this one has " + std::to_string(path.size()));
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  std::error_code ignored;
  const fs::path folder = fs::absolute(path, ignored).parent_path();
  if (!fs::is_directory(folder, ignored)) {
    return CannotListen(listen, "there is no folder " + folder.string());
  }
  const fs::file_status file = fs::symlink_status(path, ignored);
  if (fs::exists(file) && !fs::is_socket(file)) return CannotListen(listen, "it is no socket");
  if (SomebodyAnswers(address)) return CannotListen(listen, "another server listens on it");
  return Status::Ok();
}

std::string HostOf(const std::string& listen) {
  const size_t colon = listen.rfind(':');
  std::string host = listen.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return host;
}

std::shared_ptr<grpc::ServerCredentials> CredentialsOf(const ServerOptions& options) {
  namespace grpc_tls = grpc::experimental;
  if (options.tls == nullptr) return grpc::InsecureServerCredentials();
  const TlsFiles files = options.tls->copies();
  grpc_tls::TlsServerCredentialsOptions tls(
      std::make_shared<grpc_tls::FileWatcherCertificateProvider>(
          files.key, files.certificate, files.client_authorities, kReadAgain_s));
  tls.watch_identity_key_cert_pairs();
  if (!files.client_authorities.empty()) {
    tls.watch_root_certs();
    tls.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc_tls::TlsServerCredentials(tls);
}

void ConfigureTransport(const ServerOptions& options, grpc::ServerBuilder& builder) {
  builder.SetMaxReceiveMessageSize(static_cast<int>(options.max_request_bytes));
  builder.SetMaxSendMessageSize(-1);
  // Nothing is inflated: a small message could become a gigabyte before its size is checked. What
  // is compressed is refused.
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(options.max_calls_per_connection));
  grpc::ResourceQuota quota("draped");
  quota.Resize(options.max_transport_bytes);
  builder.SetResourceQuota(quota);
  // Otherwise a second server on the same port would silently take part of its connections.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS,
                             static_cast<int>(options.keepalive.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                             static_cast<int>(options.keepalive_timeout.count()));
  // A silent call sends nothing but pings; by default the third one would wait for something else
  // to be sent.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  // Clients ping, too, while a long call is under way; gRPC's own minimum is five minutes.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kLeastPing_ms);
}

// gRPC's plugins are those of all servers of the process that are built later.
class WithoutChannelz final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments*) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins,
                  [](const auto& plugin) { return plugin->name() == "channelz_service"; });
  }
};

void ConfigureChannelz(Channelz channelz, grpc::ServerBuilder& builder) {
  if (channelz != Channelz::kServed) builder.SetOption(std::make_unique<WithoutChannelz>());
  builder.AddChannelArgument(GRPC_ARG_ENABLE_CHANNELZ, channelz == Channelz::kOff ? 0 : 1);
}

// Before any builder is made.
void RegisterPlugins() {
  static std::once_flag once;
  std::call_once(once, [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::channelz::experimental::InitChannelzService();
  });
}

}  // namespace

bool IsLoopback(const std::string& listen) {
  if (listen.starts_with(kUnix)) return true;
  const std::string host = HostOf(listen);
  const bool is_numeric = host.find_first_not_of("0123456789.") == std::string::npos;
  return host == "localhost" || host == "::1" || (is_numeric && host.rfind("127.", 0) == 0);
}

Result<std::unique_ptr<GrpcServer>> GrpcServer::Start(const ServerOptions& options,
                                                      const std::vector<grpc::Service*>& services) {
  if (options.tls == nullptr && !options.allow_insecure && !IsLoopback(options.listen)) {
    return Status(StatusCode::kFailedPrecondition, "INSECURE_ADDRESS",
                  "other machines can reach " + options.listen +
                      ": give --tls-cert and --tls-key, or spell out --insecure");
  }
  DRAPE_RETURN_IF_ERROR(CheckUnixPath(options.listen));
  RegisterPlugins();
  std::unique_ptr<GrpcServer> server(new GrpcServer());
  server->health_of_ = options.health_of;
  grpc::ServerBuilder builder;
  ConfigureTransport(options, builder);
  ConfigureChannelz(options.channelz, builder);
  builder.experimental().SetInterceptorCreators(LimitStrangerStreams());
  builder.AddListeningPort(options.listen, CredentialsOf(options), &server->port_);
  for (grpc::Service* const service : services) builder.RegisterService(service);
  server->server_ = builder.BuildAndStart();
  if (!server->server_ || server->port_ == 0) {
    return CannotListen(options.listen,
                        options.listen.starts_with(kUnix)
                            ? "the socket cannot be made"
                            : "the port is in use, or the address is not one of this machine");
  }
  server->SetServing(true);
  return server;
}

GrpcServer::~GrpcServer() {
  Shutdown(std::chrono::milliseconds(0));
}

std::shared_ptr<grpc::Channel> GrpcServer::InProcessChannel() {
  return server_->InProcessChannel(grpc::ChannelArguments());
}

void GrpcServer::SetServing(bool is_serving) {
  grpc::HealthCheckServiceInterface* health = server_->GetHealthCheckService();
  health->SetServingStatus(is_serving);
  health->SetServingStatus(health_of_, is_serving);
}

void GrpcServer::Shutdown(std::chrono::milliseconds grace) {
  if (!server_) return;
  server_->Shutdown(std::chrono::system_clock::now() + grace);
  server_->Wait();
  server_ = nullptr;
}

}  // namespace drape::api
