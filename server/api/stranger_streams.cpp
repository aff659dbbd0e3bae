#include "server/api/stranger_streams.h"

#include <grpcpp/server_context.h>

#include <string>
#include <string_view>
#include <utility>

#include "server/core/session_permits.h"

namespace drape::api {
namespace {

using grpc::experimental::InterceptionHookPoints;
using grpc::experimental::ServerRpcInfo;

constexpr std::string_view kOurs = "/drape.v1.";

// Of "ipv4:127.0.0.1:5000": without the port. Others, such as sockets, are one address.
std::string AddressOf(const std::string& peer) {
  return peer.substr(0, peer.rfind(':'));
}

// Exists as long as its call, and holds its place.
class Place final : public grpc::experimental::Interceptor {
 public:
  Place(SessionPermits& permits, ServerRpcInfo* call) : permits_(permits), call_(call) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_INITIAL_METADATA)) {
      const std::string peer = call_->server_context()->peer();
      auto taken = permits_.Take(peer, AddressOf(peer));
      if (taken.ok()) {
        held_ = std::move(taken).value();
      } else {
        call_->server_context()->TryCancel();
      }
    }
    methods->Proceed();
  }

 private:
  SessionPermits& permits_;
  ServerRpcInfo* const call_;
  std::shared_ptr<void> held_;
};

class Limiter final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateServerInterceptor(ServerRpcInfo* call) override {
    if (call->type() == ServerRpcInfo::Type::UNARY) return nullptr;
    if (std::string_view(call->method()).starts_with(kOurs)) return nullptr;
    return new Place(permits_, call);
  }

 private:
  SessionPermits permits_{"TOO_MANY_STREAMS",
                          {"streams per connection", kStrangerStreamsPerConnection},
                          PermitLimit{"streams", kStrangerStreams},
                          std::nullopt};
};

}  // namespace

std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>>
LimitStrangerStreams() {
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> limiters;
  limiters.push_back(std::make_unique<Limiter>());
  return limiters;
}

}  // namespace drape::api
