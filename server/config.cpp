#include "server/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <map>

#include "server/api/grpc_server.h"
#include "server/config_file.h"
#include "server/core/memory_size.h"

namespace drape {
namespace {

const std::map<std::string, BackendChoice> kBackends = {{"auto", BackendChoice::kAuto},
                                                        {"gl", BackendChoice::kGl},
                                                        {"cpu", BackendChoice::kCpu},
                                                        {"reference", BackendChoice::kReference}};

constexpr uint64_t kLeastLimit_bytes = uint64_t{16} << 20;  // of FitToMemory
constexpr uint64_t kLeastTransport_bytes = uint64_t{64} << 20;

// The error in HOST:PORT, or empty.
std::string ListenProblem(const std::string& listen) {
  const size_t colon = listen.rfind(':');
  if (colon == std::string::npos || colon == 0) return "'" + listen + "' is not HOST:PORT";
  const std::string port = listen.substr(colon + 1);
  const bool is_number = !port.empty() && port.size() <= 5 &&
                         port.find_first_not_of("0123456789") == std::string::npos;
  if (is_number && std::stoi(port) <= 65535) return "";
  return "port '" + port + "' is not a whole number in [0, 65535]";
}

// The error in an address for operators, or empty.
std::string AdminListenProblem(const std::string& listen) {
  constexpr char kUnix[] = "unix:";
  if (listen.starts_with(kUnix)) return listen.size() > sizeof(kUnix) - 1 ? "" : "no path";
  const std::string problem = ListenProblem(listen);
  if (!problem.empty()) return problem;
  return api::IsLoopback(listen) ? "" : "'" + listen + "' can be reached by other machines";
}

// The error in a server id, or empty.
std::string ServerIdProblem(const std::string& id) {
  const bool is_legal =
      !id.empty() && id.size() <= 32 &&
      id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") == std::string::npos;
  return is_legal ? "" : "'" + id + "' is not 1 to 32 lower-case letters and digits";
}

void AddServerFlags(CLI::App& app, Config& config) {
  app.add_option("--listen", config.listen, "HOST:PORT; port 0 picks a free one")
      ->capture_default_str()
      ->check(CLI::Validator(ListenProblem, ""));
  app.add_option("--port-file", config.port_file,
                 "file that receives the port number once the server is up");
  app.add_option_function<std::string>(
         "--backend", [&config](const std::string& name) { config.backend = kBackends.at(name); },
         "auto (gl on a hardware GPU, else cpu), gl (also on Mesa llvmpipe), cpu or reference")
      ->check(CLI::IsMember({"auto", "gl", "cpu", "reference"}))
      ->default_str("auto");
  app.add_flag("--insecure", config.insecure, "serve other machines without encryption");
  auto* cert = app.add_option("--tls-cert", config.tls.certificate,
                              "PEM certificate chain; read again when it changes")
                   ->check(CLI::ExistingFile);
  auto* key =
      app.add_option("--tls-key", config.tls.key, "PEM private key")->check(CLI::ExistingFile);
  app.add_option(
         "--tls-client-ca", config.tls.client_authorities,
         "PEM authorities; clients need their certificates, whose common name is the tenant "
         "(with --token-file: the token's)")
      ->check(CLI::ExistingFile)
      ->needs(cert);
  app.add_option("--metrics-listen", config.metrics_listen,
                 "HOST:PORT for monitoring over HTTP: /metrics, /healthz, /readyz (default: none)")
      ->check(CLI::Validator(ListenProblem, ""));
  app.add_option(
         "--admin-listen", config.admin_listen,
         "unix:PATH, or HOST:PORT of this machine, for `drape admin`; who reaches it may do "
         "everything (default: none)")
      ->check(CLI::Validator(AdminListenProblem, ""));
  app.add_option("--server-id", config.server_id,
                 "lasting name in the names of sessions, for proxies (default: a random one)")
      ->check(CLI::Validator(ServerIdProblem, ""));
  app.add_option("--token-file", config.token_file,
                 "tenants and the SHA-256 of their tokens; read again at SIGHUP")
      ->check(CLI::ExistingFile);
  cert->needs(key);
  key->needs(cert);
  app.add_option("--checkpoint-dir", config.checkpoints.folder,
                 "folder to which sessions are written, and from which they come back at the start "
                 "(default: none)");
  app.add_option("--log-level", config.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_option_function<std::string>(
         "--log-format",
         [&config](const std::string& name) {
           config.log_format = name == "json" ? LogFormat::kJson : LogFormat::kText;
         },
         "text, or json: an object per line")
      ->check(CLI::IsMember({"text", "json"}))
      ->default_str("text");
  app.add_option("--shader-dir", config.shader_dir, "folder of shaders that replace built-in ones")
      ->check(CLI::ExistingDirectory);
  app.add_option("--program-cache-dir", config.program_cache_dir,
                 "folder of kernels compiled for the GPU, for the next start (default: "
                 "drape/programs in the user's cache folder; with Mesa llvmpipe none)");
  app.add_option(
      "--device", config.device,
      "GPU of the gl backend: index, PCI address or UUID of --list-devices; default: the "
      "first that works");
  app.add_option("--device-timeout-s", config.device_timeout_s,
                 "a device that does not answer for that long is lost: the server begins anew; 0: "
                 "never")
      ->capture_default_str();
  app.add_flag("--list-devices", config.lists_devices, "print the GPUs and end")
      ->configurable(false);
  app.add_option("--threads", config.threads, "threads of the cpu backend; 0 = one per core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
}

template <class T>
void AddNumber(CLI::App& app, const std::string& name, T& value, T min, T max,
               const std::string& meaning) {
  const std::string range = "in [" + std::to_string(min) + ", " + std::to_string(max) + "]";
  // Not CLI::Range, which lets NaN through.
  const auto check = [=](const std::string& text) {
    T number{};
    const bool is_legal = CLI::detail::lexical_cast(text, number) && number >= min && number <= max;
    return is_legal ? std::string() : "'" + text + "' is not " + range;
  };
  app.add_option(name, value, meaning)
      ->check(CLI::Validator(check, range))
      ->capture_default_str()
      ->group("Limits");
}

void AddLimits(CLI::App& app, Config& config) {
  constexpr uint32_t kMaxCount = UINT32_MAX;
  constexpr uint32_t kMaxTime_ms = 3'600'000;
  api::RequestLimits& requests = config.requests;
  SessionLimits& sessions = config.sessions;
  SchedulerLimits& scheduler = config.scheduler;
  AddNumber(app, "--max-sessions", sessions.max_sessions, 1u, kMaxCount, "open at once");
  AddNumber(app, "--session-ttl-s", requests.default_ttl_s, kMinTtl_s, kMaxTtl_s,
            "lease of a session that requests none");
  AddNumber(app, "--max-sessions-per-tenant", sessions.per_tenant.max_sessions, 0u, kMaxCount,
            "with --token-file; 0: a quarter of --max-sessions");
  AddNumber<uint64_t>(app, "--max-cloths-per-tenant", sessions.per_tenant.max_cloths, 0,
                      UINT64_MAX / 2, "0: four times those of a session");
  AddNumber<uint64_t>(app, "--max-particles-per-tenant", sessions.per_tenant.max_particles, 0,
                      UINT64_MAX / 2, "0: twice those of a session");
  AddNumber(app, "--max-particle-substeps-per-s-per-tenant",
            config.max_particle_substeps_per_s_per_tenant, 0.0, 1e18,
            "stepped for a tenant, beyond a second's worth at once; more waits; 0: no limit. "
            "The token file may name others");
  AddNumber(app, "--max-builder-s-per-s-per-tenant", config.max_builder_s_per_s_per_tenant, 0.0,
            1e6,
            "seconds of builder threads per second, beyond a minute's worth at once; more is "
            "refused until later; 0: no limit. The token file may name others");
  AddNumber(app, "--max-cloths-per-session", sessions.max_cloths_per_session, 1u, kMaxCount, "");
  AddNumber<uint64_t>(app, "--max-particles-per-session", sessions.max_particles_per_session, 1,
                      UINT64_MAX / 2, "");
  AddNumber(app, "--max-particles-per-cloth", requests.model.max_particles, 1u, 1u << 24, "");
  AddNumber(app, "--max-colliders-per-cloth", requests.max_colliders_per_cloth, 0u, 65536u, "");
  AddNumber(app, "--max-mesh-colliders-per-cloth", requests.max_mesh_colliders_per_cloth, 0u,
            65536u, "each may take seconds to build");
  AddNumber(app, "--max-bodies-per-cloth", requests.max_bodies_per_cloth, 0u, 256u,
            "colliders with a mass, each of which meets every particle and collider");
  AddNumber<uint64_t>(app, "--max-mesh-collider-bytes-per-session",
                      sessions.max_mesh_collider_bytes_per_session, 0, UINT64_MAX / 2,
                      "distance grids and meshes, equal ones counted once");
  AddNumber<uint64_t>(app, "--max-mesh-collider-bytes", sessions.max_mesh_collider_bytes, 0,
                      UINT64_MAX / 2,
                      "the same of all sessions; a tenant, or a session without one, may have "
                      "half, and no more than it leaves free");
  AddNumber<uint64_t>(app, "--max-state-bytes", sessions.max_state_bytes, 1u << 20, UINT64_MAX / 2,
                      "states of the cloths of all sessions, 8192 bytes for a cloth and 160 for a "
                      "particle, where they are in the memory of the process (all but a GPU's); a "
                      "tenant may have no more than it leaves free");
  AddNumber<uint64_t>(app, "--max-model-bytes", sessions.max_model_bytes, 1u << 20, UINT64_MAX / 2,
                      "models of cloths of all sessions, equal ones of a tenant counted once, and "
                      "colliders; a tenant, or a session without one, may have half");
  AddNumber(app, "--max-steps-per-request", scheduler.max_steps_per_request, 1u, kMaxCount, "");
  AddNumber(app, "--max-cloths-per-batch", scheduler.max_cloths_per_batch, 1u, kMaxCount,
            "cloths stepped together");
  AddNumber<int64_t>(app, "--max-queue-delay-us", scheduler.max_queue_delay_us, 0, 1'000'000,
                     "longest wait of a batch for clients that are about to ask again");
  AddNumber(app, "--max-queued-requests", scheduler.max_queued_requests, 1u, kMaxCount,
            "waiting step requests of all sessions");
  AddNumber(app, "--max-queued-requests-per-session", scheduler.max_queued_requests_per_session, 1u,
            kMaxCount, "waiting step requests");
  AddNumber<int64_t>(app, "--batch-budget-us", scheduler.batch_budget_us, 1000, 10'000'000,
                     "of device time until others are stepped; longer steps are done in pieces");
  AddNumber<uint64_t>(app, "--max-long-step-bytes", scheduler.max_long_step_bytes, 0,
                      UINT64_MAX / 2,
                      "working memory of steps that are done in pieces at the same time; one may "
                      "have more");
  AddNumber<uint64_t>(app, "--max-unread-bytes", requests.max_unread_bytes, 1u << 20,
                      UINT64_MAX / 2, "requests under way and answers not read, of all sessions");
  AddNumber<uint64_t>(app, "--max-unread-bytes-per-session", requests.max_unread_bytes_per_session,
                      1u << 20, UINT64_MAX / 2, "a single one may be larger");
  AddNumber<uint64_t>(app, "--max-remembered-bytes", sessions.max_remembered_bytes, 0,
                      UINT64_MAX / 2, "answers kept for repeated request ids");
  AddNumber<uint64_t>(app, "--max-request-id-bytes", sessions.max_request_id_bytes, 0,
                      UINT64_MAX / 2,
                      "memory of the request ids of all sessions, 430 for one of 36 characters; a "
                      "tenant, or a session without one, may have half");
  AddNumber<uint64_t>(app, "--max-saved-bytes", sessions.max_saved_bytes, 0, UINT64_MAX / 2,
                      "states that sessions keep in memory by name (SaveStates)");
  AddNumber<int64_t>(app, "--request-ids-kept-us", sessions.requests.keep_us, 1'000'000,
                     int64_t{86'400} * 1'000'000, "how long a completed request id is known");
  AddNumber(app, "--max-connections", config.max_connections, 0u, kMaxCount,
            "0: what the limit of open files allows");
  AddNumber(
      app, "--max-connections-per-peer", config.max_connections_per_peer, 0u, kMaxCount,
      "of one address (IPv6: of one /64 network) but loopback; 0: no limit, for servers behind "
      "a proxy");
  AddNumber(app, "--max-calls-per-connection", config.max_calls_per_connection, 1u, 1u << 20,
            "under way; more wait at the client");
  AddNumber(app, "--max-streams", requests.max_streams, 1u, 1u << 20,
            "open StepStream, StreamStates, Run and ImportCloths calls");
  AddNumber<uint64_t>(app, "--max-transport-bytes", config.max_transport_bytes,
                      kLeastTransport_bytes, UINT64_MAX / 2, "buffers of all connections");
  AddNumber<uint64_t>(app, "--max-step-state-bytes", requests.max_step_state_bytes, 0, 1u << 30,
                      "states in a Step answer");
  AddNumber(app, "--max-pictures-in-flight-per-session",
            config.pictures.max_pictures_in_flight_per_session, 1u, kMaxCount,
            "waiting, being drawn or being sent");
  AddNumber(app, "--max-queued-pictures", config.pictures.max_queued_pictures, 1u, kMaxCount,
            "waiting pictures of all sessions");
  AddNumber(app, "--max-particles-per-picture", config.pictures.max_particles_per_picture, 1u,
            kMaxCount, "in all its cloths, and in all pictures being drawn");
  AddNumber(app, "--checkpoint-interval-s", config.checkpoints.interval_s, 0.1, 86400.0,
            "with --checkpoint-dir: time between two checkpoints of a session that changes");
  AddNumber<uint64_t>(app, "--max-expired-bytes-per-tenant",
                      config.checkpoints.max_expired_bytes_per_tenant, 0, UINT64_MAX / 2,
                      "with --checkpoint-dir: files of sessions whose lease has run out, of all of "
                      "a tenant or all without one; the newest stay");
  AddNumber(app, "--drain-grace-ms", config.drain_grace_ms, 0u, kMaxTime_ms,
            "time to finish accepted work when the server is told to stop");
  AddNumber(app, "--reap-interval-ms", config.reap_interval_ms, 1u, kMaxTime_ms,
            "time between two searches for expired sessions");
  AddNumber(app, "--keepalive-ms", config.keepalive_ms, 1000u, kMaxTime_ms,
            "silence after which a peer is pinged");
  AddNumber(app, "--keepalive-timeout-ms", config.keepalive_timeout_ms, 100u, kMaxTime_ms,
            "time until a silent peer counts as gone");
  AddNumber(app, "--builder-threads", config.builder_threads, 1u, 256u,
            "threads that build scene models");
}

// CLI11 would take the next argument as the value: `--token-file=$FILE` without that variable would
// swallow a flag, and listen for everybody.
void CheckValuesAreThere(int argc, const char* const* argv) {
  for (int k = 1; k < argc; ++k) {
    const std::string_view argument = argv[k];
    if (argument.starts_with("--") && argument.ends_with('=')) {
      throw CLI::ArgumentMismatch(std::string(argument) + " has no value; leave the flag out");
    }
  }
}

}  // namespace

void FitToMemory(Config& config, uint64_t memory_bytes) {
  const auto fit = [memory_bytes](uint64_t& limit_bytes, uint64_t part) {
    limit_bytes = std::min(limit_bytes, std::max(memory_bytes / part, kLeastLimit_bytes));
  };
  fit(config.sessions.max_state_bytes, 6);
  fit(config.sessions.max_model_bytes, 4);
  fit(config.sessions.max_saved_bytes, 8);
  fit(config.sessions.max_mesh_collider_bytes, 8);
  fit(config.sessions.max_request_id_bytes, 16);
  fit(config.sessions.max_remembered_bytes, 32);
  fit(config.requests.max_unread_bytes, 16);  // and as much for requests that are parsed
  fit(config.requests.max_unread_bytes_per_session, 64);
  fit(config.sessions.max_mesh_collider_bytes_per_session, 64);
  fit(config.max_transport_bytes, 16);
  fit(config.scheduler.max_long_step_bytes, 24);
  config.max_transport_bytes = std::max(config.max_transport_bytes, kLeastTransport_bytes);
}

CommandLine ParseCommandLine(int argc, const char* const* argv) {
  CommandLine result;
  FitToMemory(result.config, MemoryOfProcess_bytes());
  CLI::App app("draped: simulates cloths for its clients, on a GPU if there is one", "draped");
  app.set_version_flag("--version", std::string("draped ") + DRAPE_VERSION);
  app.config_formatter(std::make_shared<ConfigFile>(app));
  app.set_config(
      "--config", "",
      "file of these settings: protobuf text (--print-config), JSON, or name=value lines");
  app.allow_config_extras(CLI::config_extras_mode::error);
  AddServerFlags(app, result.config);
  AddLimits(app, result.config);
  bool prints_config = false;
  app.add_flag("--print-config", prints_config, "print all settings as a --config file and end")
      ->configurable(false);
  try {
    CheckValuesAreThere(argc, argv);
    app.parse(argc, argv);
    if (prints_config) {
      std::cout << ConfigAsText(app);
      result.exit_code = 0;
    }
  } catch (const CLI::ParseError& error) {
    constexpr int kUsageError = 2;
    result.exit_code = app.exit(error) == 0 ? 0 : kUsageError;
  }
  return result;
}

}  // namespace drape
