#include "server/wiring.h"

#include <sched.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <future>
#include <random>
#include <thread>
#include <utility>

#include "server/api/accept_guard.h"
#include "server/api/build_queue.h"
#include "server/api/tls_files.h"
#include "server/core/memory_reserve.h"
#include "server/core/memory_size.h"

namespace drape {

using std::chrono::milliseconds;

void DivideMemory(const Config& config) {
  constexpr uint64_t kMost_bytes = uint64_t{64} << 20;
  MemoryReserve::Keep(std::min(kMost_bytes, MemoryOfProcess_bytes() / 16));
  spdlog::info(
      "memory bytes={} max_state_bytes={} max_model_bytes={} max_saved_bytes={} "
      "max_mesh_collider_bytes={} max_unread_bytes={} max_request_id_bytes={} "
      "max_remembered_bytes={} max_transport_bytes={} max_long_step_bytes={}",
      MemoryOfProcess_bytes(), config.sessions.max_state_bytes, config.sessions.max_model_bytes,
      config.sessions.max_saved_bytes, config.sessions.max_mesh_collider_bytes,
      config.requests.max_unread_bytes, config.sessions.max_request_id_bytes,
      config.sessions.max_remembered_bytes, config.max_transport_bytes,
      config.scheduler.max_long_step_bytes);
}

std::string RandomHex() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

std::string WithPort(const std::string& listen, int port) {
  return listen.substr(0, listen.rfind(':') + 1) + std::to_string(port);
}

Result<api::ServerOptions> ToServerOptions(const Config& config) {
  api::ServerOptions options;
  options.listen = config.listen;
  if (config.tls.is_on()) {
    DRAPE_ASSIGN_OR_RETURN(options.tls, api::TlsInUse::Open(config.tls));
  }
  options.allow_insecure = config.insecure;
  options.max_request_bytes = config.requests.max_request_bytes;
  options.max_calls_per_connection = config.max_calls_per_connection;
  options.max_transport_bytes = config.max_transport_bytes;
  options.keepalive = milliseconds(config.keepalive_ms);
  options.keepalive_timeout = milliseconds(config.keepalive_timeout_ms);
  if (!config.admin_listen.empty()) options.channelz = api::Channelz::kCounted;
  return options;
}

SessionLimits WithTenantLimits(SessionLimits limits, const BackendDescription& backend) {
  if (backend.is_hardware_gpu) limits.max_state_bytes = 0;  // states are in its memory
  TenantLimits& tenant = limits.per_tenant;
  if (tenant.max_sessions == 0) tenant.max_sessions = std::max(1u, limits.max_sessions / 4);
  if (tenant.max_cloths == 0) tenant.max_cloths = 4 * uint64_t{limits.max_cloths_per_session};
  if (tenant.max_particles == 0) tenant.max_particles = 2 * limits.max_particles_per_session;
  return limits;
}

Result<std::shared_ptr<api::Authentication>> ReadTokens(const Config& config) {
  if (config.token_file.empty()) {
    if (config.tls.client_authorities.empty()) return std::shared_ptr<api::Authentication>();
    return api::Authentication::ByCertificate();
  }
  DRAPE_ASSIGN_OR_RETURN(api::TokenFile tokens, api::TokenFile::Read(config.token_file));
  return std::make_shared<api::Authentication>(std::move(tokens));
}

std::vector<std::pair<std::string, std::string>> NamesOf(const SessionRegistry& sessions) {
  std::vector<std::pair<std::string, std::string>> names = sessions.LostNames();
  for (const auto& session : sessions.All()) {
    names.emplace_back(session->name(), session->tenant());
  }
  return names;
}

void RememberLost(const std::vector<std::pair<std::string, std::string>>& names,
                  SessionRegistry& sessions) {
  for (const auto& [name, tenant] : names) {
    if (!sessions.Get(name, tenant).ok()) sessions.RememberLost(name, tenant);
  }
}

void WarnOfUnreachable(const SessionRegistry& sessions, const api::Authentication* authentication) {
  const auto all = sessions.All();
  const bool has_tenants = authentication != nullptr;
  const auto count = std::ranges::count_if(
      all, [&](const auto& session) { return session->tenant().empty() == has_tenants; });
  if (count == 0) return;
  spdlog::warn(
      "sessions_unreachable count={} message=\"nobody can reach them before their leases "
      "run out: {}\"",
      count,
      has_tenants ? "they are of a server without tokens"
                  : "they are of tenants, and this server has no --token-file");
}

void SetRates(const Config& config, const api::Authentication* authentication, RateQuota& steps,
              RateQuota& builders) {
  RateLimits of_steps, of_builders;
  of_steps.per_tenant = config.max_particle_substeps_per_s_per_tenant;
  of_builders.per_tenant = config.max_builder_s_per_s_per_tenant;
  if (authentication != nullptr) {
    of_steps.of_tenant = authentication->rates();
    of_steps.weights = authentication->weights();
    of_builders.of_tenant = authentication->builder_rates();
  }
  steps.Set(std::move(of_steps));
  builders.Set(std::move(of_builders));
}

Status WritePortFile(const std::string& path, int port) {
  if (path.empty()) return Status::Ok();
  const std::string draft = path + ".draft";
  std::ofstream file(draft);
  file << port << "\n";
  file.close();
  if (file && std::rename(draft.c_str(), path.c_str()) == 0) return Status::Ok();
  return Status(StatusCode::kFailedPrecondition, "PORT_FILE_FAILED", "cannot write " + path);
}

api::AdminContext ForOperators(const api::ServiceContext& parts, CheckpointKeeper& checkpoints) {
  api::AdminContext context{parts, [] { kill(getpid(), SIGUSR2); }, {}};  // main takes the signal
  if (checkpoints.is_on()) {
    context.write_checkpoints = [&checkpoints] { return checkpoints.WriteRound(); };
  }
  return context;
}

Result<std::unique_ptr<api::GrpcServer>> StartAdmin(const Config& config,
                                                    api::AdminService& service) {
  if (config.admin_listen.empty()) return std::unique_ptr<api::GrpcServer>();
  api::ServerOptions options;
  options.listen = config.admin_listen;
  options.channelz = api::Channelz::kServed;
  options.health_of = "drape.v1.AdminService";
  auto server = [&] {
    // A socket in the file system is the operators' alone. The mask of a thread of its own: with
    // that of the process others would make files, too, meanwhile.
    std::promise<Result<std::unique_ptr<api::GrpcServer>>> started;
    std::thread([&] {
      if (unshare(CLONE_FS) != 0) {
        return started.set_value(Status(StatusCode::kFailedPrecondition, "LISTEN_FAILED",
                                        "no thread may have a umask of its own"));
      }
      umask(S_IRWXG | S_IRWXO);
      started.set_value(api::GrpcServer::Start(options, {&service}));
    }).join();
    return started.get_future().get();
  }();
  if (server.ok()) {
    const bool is_socket = config.admin_listen.starts_with("unix:");
    const std::string port = is_socket ? "" : fmt::format(" port={}", (*server)->port());
    spdlog::info("admin_started listen={}{}", config.admin_listen, port);
  }
  return server;
}

ServerNumbers NumbersOf(const api::ServiceContext& parts) {
  const Scheduler& scheduler = parts.scheduler;
  const SessionRegistry& sessions = parts.sessions;
  const SchedulerCounters counters = scheduler.counters();
  const ServerTotals totals = sessions.TotalsOfAll();
  ServerNumbers numbers;
  numbers.version = DRAPE_VERSION;
  numbers.backend = scheduler.description().name;
  numbers.is_draining = scheduler.is_draining();
  numbers.batches = counters.rounds;
  numbers.dispatches = counters.dispatches;
  numbers.cloth_steps = counters.cloth_steps;
  numbers.cloth_steps_asleep = counters.cloth_steps_asleep;
  numbers.faults = counters.faults;
  numbers.long_step_pieces = counters.long_step_pieces;
  numbers.frames_sent = counters.frames_sent;
  numbers.frames_dropped = counters.frames_dropped;
  numbers.slow_consumers = counters.slow_consumers;
  numbers.batch_durations = counters.batch_durations;
  numbers.request_durations = counters.request_durations;
  numbers.queued_requests = counters.queued_requests;
  numbers.queued_commands = counters.queued_commands;
  numbers.sessions = totals.session_count;
  numbers.cloths = totals.cloth_count;
  numbers.particles = totals.particle_count;
  numbers.remembered_bytes = sessions.remembered_bytes();
  numbers.saved_bytes = sessions.saved_bytes();
  numbers.refused_connections = api::RefusedConnections();
  numbers.queued_builds = parts.builders.queued_count();
  numbers.refused_builds = parts.build_quota->refused;
  for (const RateUse& use : parts.build_quota->rates.Uses()) numbers.builder_s += use.work;
  return numbers;
}

}  // namespace drape
