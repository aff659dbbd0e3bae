#include "server/operations/operations_server.h"

#include <civetweb.h>

#include <atomic>
#include <cstring>
#include <utility>

namespace drape {
namespace {

int Answer(mg_connection* connection, int code, const std::string& text) {
  const char* const reason = code == 200   ? "OK"
                             : code == 405 ? "Method Not Allowed"
                                           : "Service Unavailable";
  mg_printf(connection,
            "HTTP/1.1 %d %s\r\nContent-Type: text/plain; version=0.0.4\r\nContent-Length: %zu\r\n"
            "Connection: close\r\n\r\n",
            code, reason, text.size());
  mg_write(connection, text.data(), text.size());
  return code;
}

bool IsGet(const mg_connection* connection) {
  return std::strcmp(mg_get_request_info(connection)->request_method, "GET") == 0;
}

// civetweb takes no host names.
std::string NumericAddress(const std::string& listen) {
  constexpr char kLocalhost[] = "localhost:";
  if (listen.rfind(kLocalhost, 0) != 0) return listen;
  return "127.0.0.1:" + listen.substr(sizeof(kLocalhost) - 1);
}

}  // namespace

struct OperationsServer::Impl {
  explicit Impl(std::function<ServerNumbers()> the_numbers) : numbers(std::move(the_numbers)) {}
  ~Impl() {
    if (context != nullptr) mg_stop(context);
  }

  // For what has no handler.
  static int NotFound(mg_connection* connection, void*) {
    mg_send_http_error(connection, 404, "%s", "/metrics, /healthz, /readyz");
    return 404;
  }
  static int Metrics(mg_connection* connection, void* impl) {
    if (!IsGet(connection)) return Answer(connection, 405, "GET alone\n");
    return Answer(connection, 200, MetricsText(static_cast<Impl*>(impl)->numbers()));
  }
  static int Health(mg_connection* connection, void*) {
    return Answer(connection, IsGet(connection) ? 200 : 405, "alive\n");
  }
  static int Readiness(mg_connection* connection, void* impl) {
    const bool is_ready = static_cast<Impl*>(impl)->is_ready;
    return Answer(connection, is_ready ? 200 : 503, is_ready ? "ready\n" : "not ready\n");
  }

  const std::function<ServerNumbers()> numbers;
  std::atomic<bool> is_ready = false;
  mg_context* context = nullptr;
  int port = 0;
};

OperationsServer::OperationsServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

OperationsServer::~OperationsServer() = default;

Result<std::unique_ptr<OperationsServer>> OperationsServer::Start(
    const std::string& listen, std::function<ServerNumbers()> numbers) {
  auto impl = std::make_unique<Impl>(std::move(numbers));
  const std::string address = NumericAddress(listen);
  // Few threads and short patience: nobody can hold up the others for long.
  const char* const options[] = {"listening_ports",
                                 address.c_str(),
                                 "num_threads",
                                 "4",
                                 "request_timeout_ms",
                                 "5000",
                                 "enable_keep_alive",
                                 "no",
                                 nullptr};
  mg_callbacks callbacks{};
  impl->context = mg_start(&callbacks, impl.get(), const_cast<const char**>(options));
  mg_server_port port{};
  if (impl->context == nullptr || mg_get_server_ports(impl->context, 1, &port) != 1) {
    return Status(StatusCode::kFailedPrecondition, "METRICS_LISTEN_FAILED",
                  "cannot listen on " + listen +
                      " for monitoring: the port is in use, or it is no address of this machine");
  }
  impl->port = port.port;
  mg_set_request_handler(impl->context, "/", Impl::NotFound, nullptr);
  mg_set_request_handler(impl->context, "/metrics", Impl::Metrics, impl.get());
  mg_set_request_handler(impl->context, "/healthz", Impl::Health, nullptr);
  mg_set_request_handler(impl->context, "/readyz", Impl::Readiness, impl.get());
  return std::unique_ptr<OperationsServer>(new OperationsServer(std::move(impl)));
}

int OperationsServer::port() const {
  return impl_->port;
}

void OperationsServer::SetReady(bool is_ready) {
  impl_->is_ready = is_ready;
}

}  // namespace drape
