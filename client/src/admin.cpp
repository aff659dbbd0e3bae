#include "drape/admin.h"

#include <utility>

#include "client/src/connection.h"
#include "drape/v1/admin_service.grpc.pb.h"

namespace drape {
inline namespace client {
namespace {

constexpr uint32_t kTenantSessionsPerPage = 1000;

}  // namespace

struct Admin::Impl {
  using Stub = v1::AdminService::Stub;

  // The answer to one request; throws.
  template <class Request, class Response>
  Response Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) const {
    return connection->Call(*stub, method, request);
  }

  std::shared_ptr<Connection> connection;
  std::unique_ptr<Stub> stub;
};

Admin::Admin(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Admin::Admin(Admin&&) noexcept = default;
Admin& Admin::operator=(Admin&&) noexcept = default;
Admin::~Admin() = default;

Admin Admin::Connect(const std::string& address, const ConnectOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->connection = OpenConnection(address, options, nullptr);
  impl->stub = v1::AdminService::NewStub(impl->connection->channel);
  return Admin(std::move(impl));
}

std::vector<v1::TenantUse> Admin::ListTenants() const {
  const auto answer = impl_->Call(&Impl::Stub::ListTenants, v1::ListTenantsRequest());
  return {answer.tenants().begin(), answer.tenants().end()};
}

std::vector<v1::TenantSession> Admin::ListAllSessions() const {
  std::vector<v1::TenantSession> sessions;
  v1::ListAllSessionsRequest request;
  request.set_page_size(kTenantSessionsPerPage);
  do {
    const auto page = impl_->Call(&Impl::Stub::ListAllSessions, request);
    sessions.insert(sessions.end(), page.sessions().begin(), page.sessions().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return sessions;
}

void Admin::DropSession(uint64_t number) const {
  v1::DropSessionRequest request;
  request.set_number(number);
  impl_->Call(&Impl::Stub::DropSession, request);
}

void Admin::Drain() const {
  impl_->Call(&Impl::Stub::Drain, v1::DrainRequest());
}

v1::WriteCheckpointsResponse Admin::WriteCheckpoints() const {
  return impl_->Call(&Impl::Stub::WriteCheckpoints, v1::WriteCheckpointsRequest());
}

std::string Admin::SetLogLevel(const std::string& level) const {
  v1::SetLogLevelRequest request;
  request.set_level(level);
  return impl_->Call(&Impl::Stub::SetLogLevel, request).former_level();
}

v1::RecordTraceResponse Admin::RecordTrace(double duration_s) const {
  v1::RecordTraceRequest request;
  request.set_duration_s(duration_s);
  return impl_->Call(&Impl::Stub::RecordTrace, request);
}

}  // namespace client
}  // namespace drape
