// draped: flags -> wire -> serve -> drain. Only this file and backend_choice name concrete backends
// and renderers.
#include <memory>
#include <optional>
#include <vector>

#include "server/api/accept_guard.h"
#include "server/api/admin_service.h"
#include "server/api/build_queue.h"
#include "server/api/grpc_server.h"
#include "server/api/library_logs.h"
#include "server/api/lock_checks.h"
#include "server/api/simulation_service.h"
#include "server/backend_choice.h"
#include "server/checkpoints/checkpoint_keeper.h"
#include "server/config.h"
#include "server/core/device_loss.h"
#include "server/core/heap.h"
#include "server/core/log.h"
#include "server/core/patient_clock.h"
#include "server/operations/operations_server.h"
#include "server/restart.h"
#include "server/session/reaper.h"
#include "server/signals.h"
#include "server/wiring.h"

namespace drape {
namespace {

using std::chrono::milliseconds;

// Time for streams to end after all steps are done.
constexpr milliseconds kGoodbye{1'000};

Status Serve(Config config, const std::vector<std::string>& arguments) {
  const FormerRun former = TakeFormerRun();
  if (former.port != 0) config.listen = WithPort(config.listen, former.port);
  LossHandling handling(arguments, former);
  TakeSignals();
  DivideMemory(config);
  const uint64_t files = api::RaiseFileLimit();
  const Result<api::ServerOptions> options = ToServerOptions(config);
  if (!options.ok()) return options.status();
  const Result<std::shared_ptr<api::Authentication>> authentication = ReadTokens(config);
  if (!authentication.ok()) return authentication.status();
  CancelToken hurry;                 // ends the grace of the drain
  std::unique_ptr<StopGuard> guard;  // outlives everything that may hang while it ends
  const SteadyClock clock;
  const std::string incarnation = RandomHex();
  if (former.had_gpu) DRAPE_RETURN_IF_ERROR(AwaitGpu(config));
  SetDevicePatience(std::chrono::seconds(config.device_timeout_s));
  std::optional<gl::ShareHandle> gl_context;  // of the backend, constant from the next line on
  auto scheduler =
      Scheduler::Start([&] { return MakeBackend(config, gl_context); }, config.scheduler, clock);
  if (!scheduler.ok()) return scheduler.status();
  const auto build_quota = std::make_shared<api::BuildQuota>(clock);
  SetRates(config, authentication->get(), (*scheduler)->rates(), build_quota->rates);
  render::RenderThread pictures([&] { return MakeRenderer(config, gl_context); }, config.pictures);
  const PatientClock lease_clock(clock);
  SessionRegistry sessions(
      **scheduler, WithTenantLimits(config.sessions, (*scheduler)->description()), lease_clock,
      config.server_id.empty() ? incarnation : config.server_id, !config.server_id.empty());
  api::WorkerPool builders(config.builder_threads, config.max_queued_builds);
  const auto unread = api::MakeUnreadBudget(config.requests);
  api::ServiceContext parts{**scheduler,     sessions,      builders,    pictures, clock,
                            config.requests, DRAPE_VERSION, incarnation, unread,   *authentication};
  parts.build_quota = build_quota;
  api::SimulationService service(parts);
  CheckpointKeeper checkpoints(config.checkpoints, sessions, **scheduler, config.requests,
                               DRAPE_VERSION, incarnation);
  const auto numbers = [&] {
    ServerNumbers now = NumbersOf(parts);
    now.server_id = config.server_id.empty() ? incarnation : config.server_id;
    now.unread_bytes = unread->used_bytes();
    now.runs = parts.streams->runs;
    now.run_steps_dropped = parts.streams->run_steps_dropped;
    now.frames_encoded = parts.streams->frames_encoded;
    now.checkpoint_age_s = checkpoints.age_s();
    return now;
  };
  std::unique_ptr<OperationsServer> operations;
  if (!config.metrics_listen.empty()) {
    DRAPE_ASSIGN_OR_RETURN(operations, OperationsServer::Start(config.metrics_listen, numbers));
    spdlog::info("metrics_started port={}", operations->port());
  }
  Status status = checkpoints.Start();
  WarnOfUnreachable(sessions, authentication->get());
  RememberLost(former.sessions, sessions);
  const Reaper reaper(sessions, milliseconds(config.reap_interval_ms));
  api::LimitConnections({config.max_connections, config.max_connections_per_peer});
  const api::AdminContext for_operators = ForOperators(parts, checkpoints);
  api::AdminService admin(for_operators, false), trusted_admin(for_operators, true);
  const auto admin_server = StartAdmin(config, trusted_admin);
  if (status.ok()) status = admin_server.status();
  auto server = status.ok() ? api::GrpcServer::Start(*options, {&service, &admin}) : status;
  if (status.ok()) {
    status = server.ok() ? WritePortFile(config.port_file, (*server)->port()) : server.status();
  }
  if (status.ok()) {
    const BackendDescription& backend = (*scheduler)->description();
    spdlog::info(
        "started version={} incarnation={} listen={} port={} backend={} device=\"{}\" files={}",
        DRAPE_VERSION, incarnation, config.listen, (*server)->port(), backend.name, backend.device,
        files);
    if (operations != nullptr) operations->SetReady(true);
    handling.Replace([&] {
      return FormerRun{{}, backend.is_hardware_gpu, (*server)->port(), NamesOf(sessions)};
    });
    const int signal = WaitForStop(config, **scheduler, build_quota->rates, authentication->get(),
                                   options->tls.get());
    guard = GuardDrain(config, signal, hurry);
    spdlog::info("draining signal={} grace_ms={}", signal, config.drain_grace_ms);
    handling.Replace({});  // the end is near, and its own answer to a loss
    (*server)->SetServing(false);
    if (operations != nullptr) operations->SetReady(false);
  }
  pictures.Stop();  // while the backend is there, whose context it may share
  checkpoints.Stop();
  const int64_t grace_us = status.ok() ? int64_t{config.drain_grace_ms} * 1000 : 0;
  const auto on_written = [&] { guard ? guard->Extend(kWritePatience) : void(); };
  (*scheduler)->Drain(grace_us, checkpoints.LastCommand(on_written), hurry);
  if (server.ok()) (*server)->Shutdown(kGoodbye);
  if (admin_server.ok() && *admin_server) (*admin_server)->Shutdown(kGoodbye);
  return status;
}

}  // namespace
}  // namespace drape

int main(int argc, char** argv) {
  const drape::CommandLine command_line = drape::ParseCommandLine(argc, argv);
  if (command_line.exit_code) return *command_line.exit_code;
  if (command_line.config.lists_devices) return drape::PrintDevices();
  drape::KeepFreedMemory();
  drape::Status status =
      drape::InitLog(command_line.config.log_level, command_line.config.log_format);
  drape::api::TakeLibraryLogs();
  drape::api::SkipLockChecks();
  if (status.ok()) status = drape::Serve(command_line.config, {argv, argv + argc});
  if (!status.ok()) {
    spdlog::error("failed reason={} message=\"{}\"", status.reason(), status.message());
    return 1;
  }
  spdlog::info("stopped");
  return 0;
}
