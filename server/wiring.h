// From the flags to what the parts of draped are given.
#pragma once

#include <functional>
#include <memory>

#include "server/api/admin_service.h"
#include "server/api/authentication.h"
#include "server/api/grpc_server.h"
#include "server/config.h"
#include "server/operations/metrics.h"
#include "server/scheduler/scheduler.h"
#include "server/session/session_registry.h"

namespace drape {

// Reads the TLS files.
Result<api::ServerOptions> ToServerOptions(const Config& config);

// Limits of a tenant that are not given follow from others.
SessionLimits WithTenantLimits(SessionLimits limits);

// Null without a token file.
Result<std::shared_ptr<api::Authentication>> ReadTokens(const Config& config);

// The rates of all tenants; `authentication`: null without tenants.
RateLimits RatesOf(const Config& config, const api::Authentication* authentication);

// What operators do to this process; `write_checkpoints`: null where there are none.
api::AdminContext ForOperators(const api::ServiceContext& parts,
                               std::function<void()> write_checkpoints);
// The port for operators alone; null: there is none.
Result<std::unique_ptr<api::GrpcServer>> StartAdmin(const Config& config,
                                                    api::AdminService& service);

// What the scheduler and the sessions know; the rest is left.
ServerNumbers NumbersOf(const Scheduler& scheduler, const SessionRegistry& sessions);

}  // namespace drape
