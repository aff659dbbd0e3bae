// draped: flags -> wire -> serve -> drain. Only this file and backend_choice name concrete backends
// and renderers.
#include <csignal>
#include <cstdio>
#include <fstream>
#include <optional>
#include <random>

#include "server/api/accept_guard.h"
#include "server/api/authentication.h"
#include "server/api/grpc_server.h"
#include "server/api/library_logs.h"
#include "server/api/simulation_service.h"
#include "server/api/tls_files.h"
#include "server/backend_choice.h"
#include "server/config.h"
#include "server/core/heap.h"
#include "server/core/log.h"
#include "server/core/patient_clock.h"
#include "server/core/stop_guard.h"
#include "server/session/reaper.h"

namespace drape {
namespace {

using std::chrono::milliseconds;

// Time for streams to end after all steps are done.
constexpr milliseconds kGoodbye{1'000};
// Time after the grace of a drain until the process counts as hanging.
constexpr milliseconds kStopPatience{5'000};
constexpr time_t kStatisticsPeriod_s = 10;

std::string RandomHex() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

// A reader sees the whole number or no file.
Status WritePortFile(const std::string& path, int port) {
  if (path.empty()) return Status::Ok();
  const std::string draft = path + ".draft";
  std::ofstream(draft) << port << "\n" << std::flush;
  if (std::rename(draft.c_str(), path.c_str()) == 0) return Status::Ok();
  return Status(StatusCode::kFailedPrecondition, "PORT_FILE_FAILED", "cannot write " + path);
}

Result<api::ServerOptions> ToServerOptions(const Config& config) {
  api::ServerOptions options;
  options.listen = config.listen;
  DRAPE_RETURN_IF_ERROR(api::ReadTlsFiles(config.tls_cert_file, config.tls_key_file, options));
  options.allow_insecure = config.insecure;
  options.max_request_bytes = config.requests.max_request_bytes;
  options.max_calls_per_connection = config.max_calls_per_connection;
  options.max_transport_bytes = config.max_transport_bytes;
  options.keepalive = milliseconds(config.keepalive_ms);
  options.keepalive_timeout = milliseconds(config.keepalive_timeout_ms);
  return options;
}

// Limits of a tenant that are not given follow from others.
SessionLimits WithTenantLimits(SessionLimits limits) {
  TenantLimits& tenant = limits.per_tenant;
  if (tenant.max_sessions == 0) tenant.max_sessions = std::max(1u, limits.max_sessions / 4);
  if (tenant.max_cloths == 0) tenant.max_cloths = 4 * uint64_t{limits.max_cloths_per_session};
  if (tenant.max_particles == 0) tenant.max_particles = 2 * limits.max_particles_per_session;
  return limits;
}

// Null without a token file.
Result<std::shared_ptr<api::Authentication>> ReadTokens(const Config& config) {
  if (config.token_file.empty()) return std::shared_ptr<api::Authentication>();
  DRAPE_ASSIGN_OR_RETURN(api::TokenFile tokens, api::TokenFile::Read(config.token_file));
  return std::make_shared<api::Authentication>(std::move(tokens));
}

// A file that cannot be used leaves the tokens as they are.
void ReloadTokens(const Config& config, api::Authentication* authentication) {
  if (authentication == nullptr) return spdlog::info("signal_ignored signal=SIGHUP");
  Result<api::TokenFile> tokens = api::TokenFile::Read(config.token_file);
  if (!tokens.ok()) {
    return spdlog::error("tokens_kept message=\"{}\"", tokens.status().message());
  }
  spdlog::info("tokens_read count={}", tokens->token_count());
  authentication->Replace(std::move(tokens).value());
}

// The signals that end the server; blocked in every thread, taken by main alone.
sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

// Those, and the ones that ask for something else.
sigset_t AwaitedSignals() {
  sigset_t signals = StopSignals();
  sigaddset(&signals, SIGHUP);
  sigaddset(&signals, SIGUSR1);
  return signals;
}

void LogStatistics(spdlog::level::level_enum level, const Scheduler& scheduler) {
  const SchedulerCounters counters = scheduler.counters();
  spdlog::log(
      level,
      "statistics rounds={} dispatches={} cloth_steps={} asleep={} faults={} queued_requests={} "
      "refused_connections={}",
      counters.rounds, counters.dispatches, counters.cloth_steps, counters.cloth_steps_asleep,
      counters.faults, counters.queued_requests, api::RefusedConnections());
}

// SIGUSR1 asks for statistics. SIGHUP comes to servers that shall read their files again, and when
// a terminal is closed; neither ends this one.
int WaitForStop(const Config& config, const Scheduler& scheduler,
                api::Authentication* authentication) {
  const sigset_t signals = AwaitedSignals();
  const timespec period{kStatisticsPeriod_s, 0};
  while (true) {
    const int signal = sigtimedwait(&signals, nullptr, &period);
    if (signal == SIGINT || signal == SIGTERM) return signal;
    if (signal == SIGHUP) ReloadTokens(config, authentication);
    LogStatistics(signal == SIGUSR1 ? spdlog::level::info : spdlog::level::debug, scheduler);
  }
}

Status Serve(const Config& config) {
  const sigset_t signals = StopSignals();
  const sigset_t awaited = AwaitedSignals();
  pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // of a log that nobody reads any more
  const uint64_t files = api::RaiseFileLimit();
  const Result<api::ServerOptions> options = ToServerOptions(config);
  if (!options.ok()) return options.status();
  const Result<std::shared_ptr<api::Authentication>> authentication = ReadTokens(config);
  if (!authentication.ok()) return authentication.status();
  std::optional<StopGuard> guard;  // outlives everything that may hang while it ends
  const SteadyClock clock;
  const std::string incarnation = RandomHex();
  std::optional<gl::ShareHandle> gl_context;  // of the backend, constant from the next line on
  auto scheduler =
      Scheduler::Start([&] { return MakeBackend(config, gl_context); }, config.scheduler, clock);
  if (!scheduler.ok()) return scheduler.status();
  render::RenderThread pictures([&] { return MakeRenderer(config, gl_context); }, config.pictures);
  const PatientClock lease_clock(clock);
  SessionRegistry sessions(**scheduler, WithTenantLimits(config.sessions), lease_clock,
                           incarnation);
  api::WorkerPool builders(config.builder_threads, config.max_queued_builds);
  api::SimulationService service({**scheduler, sessions, builders, pictures, clock, config.requests,
                                  DRAPE_VERSION, incarnation, nullptr, *authentication});
  const Reaper reaper(sessions, milliseconds(config.reap_interval_ms));
  api::LimitConnections(config.max_connections);
  auto server = api::GrpcServer::Start(*options, service);
  Status status =
      server.ok() ? WritePortFile(config.port_file, (*server)->port()) : server.status();
  if (status.ok()) {
    const BackendDescription& backend = (*scheduler)->description();
    spdlog::info(
        "started version={} incarnation={} listen={} port={} backend={} device=\"{}\" files={}",
        DRAPE_VERSION, incarnation, config.listen, (*server)->port(), backend.name, backend.device,
        files);
    const int signal = WaitForStop(config, **scheduler, authentication->get());
    guard.emplace(signals, milliseconds(config.drain_grace_ms) + kStopPatience);
    spdlog::info("draining signal={} grace_ms={}", signal, config.drain_grace_ms);
    (*server)->SetServing(false);
  }
  pictures.Stop();  // while the backend is there, whose context it may share
  (*scheduler)->Drain(status.ok() ? int64_t{config.drain_grace_ms} * 1000 : 0);
  if (server.ok()) (*server)->Shutdown(kGoodbye);
  return status;
}

}  // namespace
}  // namespace drape

int main(int argc, char** argv) {
  const drape::CommandLine command_line = drape::ParseCommandLine(argc, argv);
  if (command_line.exit_code) return *command_line.exit_code;
  drape::KeepFreedMemory();
  drape::Status status = drape::InitLog(command_line.config.log_level);
  drape::api::TakeLibraryLogs();
  if (status.ok()) status = drape::Serve(command_line.config);
  if (!status.ok()) {
    spdlog::error("failed reason={} message=\"{}\"", status.reason(), status.message());
    return 1;
  }
  spdlog::info("stopped");
  return 0;
}
