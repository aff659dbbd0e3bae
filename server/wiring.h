// From the flags to what the parts of draped are given.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/api/admin_service.h"
#include "server/api/authentication.h"
#include "server/api/grpc_server.h"
#include "server/checkpoints/checkpoint_keeper.h"
#include "server/config.h"
#include "server/operations/metrics.h"
#include "server/scheduler/scheduler.h"
#include "server/session/session_registry.h"

namespace drape {

// Keeps memory with which the server goes on where there is none left (core/memory_reserve.h). Logs
// what the process may have, and the limits that follow from it.
void DivideMemory(const Config& config);

// 16 digits that no other run has.
std::string RandomHex();

// "HOST:PORT" with another port.
std::string WithPort(const std::string& listen, int port);

// Reads the TLS files.
Result<api::ServerOptions> ToServerOptions(const Config& config);

// Limits of a tenant that are not given follow from others.
SessionLimits WithTenantLimits(SessionLimits limits, const BackendDescription& backend);

// Null without a token file.
Result<std::shared_ptr<api::Authentication>> ReadTokens(const Config& config);

// Names and tenants of all sessions, and of those that were lost.
std::vector<std::pair<std::string, std::string>> NamesOf(const SessionRegistry& sessions);
// Those that are not among the sessions answer SESSION_LOST.
void RememberLost(const std::vector<std::pair<std::string, std::string>>& names,
                  SessionRegistry& sessions);

// Warns of sessions that came back and whose tenants cannot call: this server has tenants and they
// have none, or the other way round. `authentication`: null without tenants.
void WarnOfUnreachable(const SessionRegistry& sessions, const api::Authentication* authentication);

// Sets the rates of all tenants; `authentication`: null without tenants.
void SetRates(const Config& config, const api::Authentication* authentication, RateQuota& steps,
              RateQuota& builders);

// A reader sees the whole number or no file. FAILED_PRECONDITION (PORT_FILE_FAILED).
Status WritePortFile(const std::string& path, int port);

// What operators do to this process.
api::AdminContext ForOperators(const api::ServiceContext& parts, CheckpointKeeper& checkpoints);
// The port for operators alone; null: there is none.
Result<std::unique_ptr<api::GrpcServer>> StartAdmin(const Config& config,
                                                    api::AdminService& service);

// What the scheduler, the sessions and the builders know; the rest is left.
ServerNumbers NumbersOf(const api::ServiceContext& parts);

}  // namespace drape
