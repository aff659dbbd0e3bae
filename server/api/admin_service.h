// drape.v1.AdminService: for operators, who see and end what belongs to any tenant.
#pragma once

#include <functional>
#include <optional>

#include "drape/v1/admin_service.grpc.pb.h"
#include "server/api/simulation_service.h"

namespace drape::api {

// What it uses; all of it outlives the gRPC servers.
struct AdminContext {
  ServiceContext parts;  // `unread` is set
  // Ends the server as SIGTERM does, however often it is called. Returns at once.
  std::function<void()> drain;
  // Writes the sessions that have changed; blocks; the first error. Null: this server keeps none.
  std::function<Status()> write_checkpoints;
};

// Thread-safe.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;

  // `is_trusted`: who reaches the service is an operator, because nobody else reaches its port.
  // Otherwise calls carry the token of one (Authentication::IsOperator).
  AdminService(AdminContext context, bool is_trusted)
      : context_(std::move(context)), is_trusted_(is_trusted) {}

  Reactor* ListTenants(Context*, const v1::ListTenantsRequest*, v1::ListTenantsResponse*) override;
  Reactor* ListAllSessions(Context*, const v1::ListAllSessionsRequest*,
                           v1::ListAllSessionsResponse*) override;
  Reactor* DropSession(Context*, const v1::DropSessionRequest*, v1::DropSessionResponse*) override;
  Reactor* Drain(Context*, const v1::DrainRequest*, v1::DrainResponse*) override;
  Reactor* WriteCheckpoints(Context*, const v1::WriteCheckpointsRequest*,
                            v1::WriteCheckpointsResponse*) override;
  Reactor* SetLogLevel(Context*, const v1::SetLogLevelRequest*, v1::SetLogLevelResponse*) override;
  Reactor* RecordTrace(Context*, const v1::RecordTraceRequest*, v1::RecordTraceResponse*) override;

 private:
  // Ends the call of somebody who is no operator; null: go on.
  Reactor* RefuseOthers(Context* context) const;

  const AdminContext context_;
  const bool is_trusted_;
};

}  // namespace drape::api
